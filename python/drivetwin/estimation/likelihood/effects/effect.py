# SPDX-License-Identifier: MIT
"""Entry of an effect: meaning, prior size, columns of a fit, action in a synthetic log.

Run and linear response of one shift about which the columns of effects are computed.

Random walks less their means: Karhunen-Loève columns, and samples for synthetic logs.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import IntEnum
from functools import cached_property

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import SyntheticVehicle
from drivetwin.estimation.likelihood.motion import Contact, evaluate_contact, simulate_motion
from drivetwin.estimation.likelihood.parametrization import DualClutchTerm
from drivetwin.estimation.likelihood.torque_record import TorqueRecord, get_columns
from drivetwin.likelihood.point import ParameterVector
from drivetwin.likelihood.residual_covariance import LinearResponse
from drivetwin.simulation.added_elements import AddedElements
from drivetwin.simulation.driveline import INPUT, OUTPUT, WHEEL
from drivetwin.simulation.driveline_run import COMPARED
from drivetwin.simulation.dual_clutch import DualClutch, Signal, Trajectory
from drivetwin.vehicle.effects import EffectId

NODES = (INPUT, OUTPUT, WHEEL)
"""Nodes on which effects act as torques."""


@dataclass(frozen=True, eq=False)
class OperatingPoint:
    """One shift simulated at a point of the unknowns, with its response to the inputs and to
    torques on `NODES`."""

    term: DualClutchTerm
    point: ParameterVector
    model: DualClutch
    run: Trajectory
    response: LinearResponse

    @property
    def record(self) -> TorqueRecord:
        """Measured data of the shift."""
        return self.term.record

    @cached_property
    def middle(self) -> FloatArray:
        """Middle (N-1,) of each step [s]."""
        return compute_middle(self.run.time)

    @cached_property
    def progress(self) -> FloatArray:
        """Share (N,) of the span that has passed, 0 to 1."""
        time = self.run.time
        return np.asarray((time - time[0]) / self.duration)

    @property
    def duration(self) -> float:
        """Length of the span [s]."""
        return float(self.run.time[-1] - self.run.time[0])

    @cached_property
    def largest_engine_torque(self) -> float:
        """Largest magnitude of the engine torque [N m]."""
        return float(np.max(np.abs(self.record.engine_torque.values)))

    @cached_property
    def largest_shaft_torque(self) -> float:
        """Largest magnitude of the simulated shaft torque [N m]."""
        return float(np.max(np.abs(self.run.shaft_torque)))

    @cached_property
    def load(self) -> float:
        """Magnitude of the load at the output shaft [N m]."""
        return abs(self.term.plant.compute_load(self.point))

    @cached_property
    def engine_torque(self) -> FloatArray:
        """Acting engine torque (N-1,) over each step [N m]."""
        signal = self.term.plant.place_torque(self.point, self.record.engine_torque)
        return np.interp(self.middle, signal.arrival, signal.values)

    @cached_property
    def oncoming_share(self) -> FloatArray:
        """Share (N-1,) of the torque that the on-coming element has taken over, from 0 to 1."""
        offgoing, oncoming = (
            np.abs(compute_middle(self.run.clutch_torque[one.name])) * one.a
            for one in self.term.plant.elements
        )
        share = oncoming / np.maximum(offgoing + oncoming, 1e-9)
        return np.asarray(np.maximum.accumulate(np.clip(share, 0.0, 1.0)))

    def describe_shift(self) -> str:
        """Return the shift in words: its number in the log."""
        number = int(self.term.plant.label.removeprefix("start")) + 1
        return f"shift {number}"

    def compute_rate(self, column: FloatArray) -> FloatArray:
        """Compute the rate of change (N-1,) of a column (N,) over each step."""
        return np.asarray(np.diff(column) / np.diff(self.run.time))

    def evaluate_contact(self, element: str) -> Contact:
        """Evaluate slip, pressure and friction of an element over each step."""
        return evaluate_contact(self.term, self.point, self.run, element)

    def compute_change(self, added: AddedElements) -> dict[str, FloatArray]:
        """Compute the changes (N,) of the compared signals by name where elements take the place of
        those beside the dual clutch; NaN where the run fails."""
        record, plant = self.record, self.term.plant
        changed = plant.build_task(self.point, record.inputs, record.time, added).simulate()
        before = get_columns(self.run)
        return {name: changed.columns[COMPARED[name]] - one for name, one in before.items()}


def compute_middle(column: FloatArray) -> FloatArray:
    """Compute the means (N-1,) of successive samples of a column (N,)."""
    return np.asarray(0.5 * (column[1:] + column[:-1]))


def evaluate_operating_point(term: DualClutchTerm, point: ParameterVector) -> OperatingPoint | None:
    """Simulate a shift at `point` and linearise it; None if it has no complete, finite run."""
    run, response = simulate_motion(term, point), term.compute_response(point, NODES)
    if run is None or response is None:
        return None
    return OperatingPoint(term, point, term.plant.build_model(point), run, response)


@dataclass(frozen=True, eq=False)
class Disturbance:
    """Action of an effect on the driveline, or on the measured signals, over the steps of a run.

    `subject` is the element, gear or frequency to which the effect belongs; empty for one of the
    whole driveline. `torques` (N-1,) [N m] act on some of `NODES`, `inputs` (N-1,) are changes of
    inputs by name, `outputs` (N,) direct changes of compared signals by name.
    """

    subject: str = ""
    torques: Mapping[str, FloatArray] = field(default_factory=dict)
    inputs: Mapping[str, FloatArray] = field(default_factory=dict)
    outputs: Mapping[str, FloatArray] = field(default_factory=dict)


Builder = Callable[[OperatingPoint, float], Sequence[Disturbance]]
"""Builds the columns of an effect at an operating point for one standard deviation of its prior,
given in the unit of the effect. Columns of one subject are independent; they form one group."""
Action = Callable[[SyntheticVehicle, float], SyntheticVehicle]
"""Applies an effect of a size above 0 to the vehicle of a synthetic log."""


@dataclass(frozen=True, eq=False)
class Effect:
    """One entry of the table of effects.

    `std` is the default standard deviation of its normal prior about zero in `unit`, `source` the
    reason for it. `meaning` completes "the log shows ..."; `remedy` is advice where it is found.
    A `random` effect is a sample of a random process: no single value of it can be stated.
    The columns grow with the `power` of the size, of which the amount has the sign. A `curved`
    effect is not proportional to that: a further step computes its column at the size found before,
    with the sign of that if the effect is `signed`.
    """

    id: EffectId
    meaning: str
    unit: str
    std: float
    source: str
    remedy: str
    build: Builder
    apply: Action
    random: bool = False
    power: float = 1.0
    curved: bool = False
    signed: bool = False
    has_columns: bool = True
    """False where no column at the minimum of the dual clutch describes the effect."""
    negative: str = ""
    """Meaning of a negative size, where its sign is not evident."""
    limit: float = math.inf
    """Size in a synthetic log from which a torque would reverse or a share exceed the whole."""
    on_sensor: bool = False
    """True where the effect changes recorded outputs and leaves the motion as it is."""

    def scale_amount(self, amount: float, std: float) -> float:
        """Return the size of an `amount`, in units of the columns, of the stated size `std`."""
        return std * float(np.sign(amount) * np.abs(amount) ** (1.0 / self.power))


_STEP = 0.01
"""Time between the points of a sample [s], short against what a shift log resolves of it."""


def build_random_walk(progress: FloatArray, count: int, growth: float) -> list[FloatArray]:
    """Build the first `count` columns (N,) of a random walk less its mean over a span.

    Parameters
    ----------
    progress : share (N,) of the span that has passed, 0 to 1
    growth : standard deviation of the walk's change over the whole span

    Notes
    -----
    A Wiener process of variance `growth`² at the end of the span, less its mean, is the sum of
    cosines cos(kπu) with independent amounts of standard deviation growth·√2/(kπ).
    """
    order = np.arange(1, count + 1)
    sizes = growth * np.sqrt(2.0) / (order * np.pi)
    return [size * np.cos(k * np.pi * progress) for k, size in zip(order, sizes, strict=True)]


class WalkStream(IntEnum):
    """Streams of random numbers, apart from the noise of the sensors and from each other."""

    LOAD = 101
    OUTPUT_TORQUE = 102
    TORQUE_MAP = 103


def draw_walk(stream: WalkStream, seed: int, duration: float) -> Signal:
    """Draw a random walk over `duration` [s], its variance 1 after 1 s, less its mean."""
    count = int(np.ceil(duration / _STEP)) + 1
    steps = np.random.default_rng([seed, stream]).standard_normal(count - 1) * np.sqrt(_STEP)
    walk = np.concatenate([[0.0], np.cumsum(steps)])
    return Signal(
        np.linspace(0.0, (count - 1) * _STEP, count),
        np.asarray(walk - np.mean(walk), dtype=np.float64),
    )
