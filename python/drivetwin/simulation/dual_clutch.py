# SPDX-License-Identifier: MIT
"""The dual-clutch driveline of THEORY section 3 and its simulation, as seen from Python.

The physics is computed by the Rust core; these classes only hold data.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivetwin.errors import InputError
from drivetwin.simulation.element_schema import (
    as_array,
    require_number,
    require_samples,
)
from drivetwin.simulation.variable import sign

FloatArray = NDArray[np.float64]
LossLaw = Literal["paper", "dissipative"]

LATEST = 1e6
"""Largest magnitude of a time in a run [s], 12 days. The time resolution of the core is relative to
the magnitude of the times, so Unix time stamps would give wrong results."""

ENGINE_TORQUE = "engine torque"
"""Name of that input of a dual clutch; the pressures have those of their elements."""

CoreSamples = tuple[str, FloatArray, FloatArray, float]
"""Name of an input, times [s], values and delay [s]."""

CoreStart = tuple[list[tuple[str, float]], list[tuple[str, float]], list[str]]
"""Speeds [rad/s] by node, twists [rad] by shaft, names of elements without slip."""

ORDERS = range(1, 15)
"""Fixed orders of integration; a step of the core holds no more than 15 Taylor coefficients."""


@dataclass(frozen=True)
class Stribeck:
    """μ(s) = mu_c + (mu_s - mu_c)·exp(-|s|/v_s) + mu_v·|s|; s and v_s in rad/s, mu_v in s/rad."""

    mu_c: Annotated[float, Field(ge=0)]
    mu_s: Annotated[float, Field(ge=0)]
    v_s: Annotated[float, Field(gt=0)]
    mu_v: float

    def evaluate(self, slip: FloatArray) -> FloatArray:
        """μ at slips (n,) [rad/s] of either sign."""
        linear = np.array([self.mu_c, self.mu_s - self.mu_c, self.mu_v])
        return np.asarray(
            np.tensordot(linear, self.compute_slopes(slip)[:3], axes=1), dtype=np.float64
        )

    def compute_slopes(self, slip: FloatArray) -> FloatArray:
        """Derivatives (4, n) of μ by mu_c, mu_s - mu_c, mu_v, in which it is linear, and ln v_s."""
        size = np.abs(slip)
        fall = np.exp(-size / self.v_s)
        bend = (self.mu_s - self.mu_c) * fall * size / self.v_s
        return np.stack([np.ones_like(size), fall, size, bend])


@dataclass(frozen=True)
class FrictionTable:
    """μ linear between `slip` (n,) [rad/s], increasing from 0, and constant beyond its end."""

    slip: tuple[float, ...]
    mu: tuple[float, ...]

    def evaluate(self, slip: FloatArray) -> FloatArray:
        """μ at slips (n,) [rad/s] of either sign."""
        return np.asarray(np.interp(np.abs(slip), self.slip, self.mu), dtype=np.float64)


@dataclass(frozen=True)
class ShiftElement:
    """One clutch of the dual-clutch form: slip = ω_in/i_c - i_out·ω_out (eq. 15).

    `gain` = N·D·A·r [m^3]; capacity = μ·gain·max(0, P - P0) [N m]; static capacity `peak` times
    μ(0). `drum_inertia` [kg m^2] rotates at slip speed (THEORY section 2).
    """

    name: str
    i_c: float
    i_out: float
    gain: float
    P0: float
    friction: Stribeck | FrictionTable
    peak: float = 1.0
    drum_inertia: float = 0.0


@dataclass(frozen=True)
class RoadLoad:
    """Load torque at the wheel [N m] against forward motion, from vehicle speed r_w·ω_w.

    `constant` holds in either direction of motion (a dynamometer or grade load); `rolling` opposes
    the motion; `aero` is ½·ρ·c_d·A·r_w^3 [N m s^2/rad^2], times ω_w·|ω_w|.
    """

    constant: float = 0.0
    rolling: float = 0.0
    aero: float = 0.0

    def evaluate(self, wheel_speed: float) -> float:
        """Load torque at the wheel [N m] at a speed [rad/s] of either sign."""
        square = self.aero * wheel_speed * abs(wheel_speed)
        return self.constant + self.rolling * sign(wheel_speed) + square


@dataclass(frozen=True)
class DualClutch:
    """Parameters of eqs. 2-9, SI. `J_v` is at the wheel; J2e as in THEORY section 3.

    Only J1·η + J2e is identifiable; an identified model carries it as J2e = 0, J1 = Je/η.
    """

    J1: float
    J2e: float
    eta: float
    loss_law: LossLaw
    i_in: float
    J_out: float
    i_f: float
    J_v: float
    k_o: float
    c_o: float
    load: RoadLoad
    elements: tuple[ShiftElement, ...]

    def get_overall_ratio(self, element: str) -> float:
        """Overall ratio ω_e/ω_out with the shift element called `element` locked."""
        held = next(one for one in self.elements if one.name == element)
        return self.i_in * held.i_c * held.i_out

    def get_efficiency(self, *, driving: bool) -> float:
        """dφ/dT_g: η, and 1/η by the dissipative law where power flows back, not `driving`."""
        return self.eta if driving or self.loss_law == "paper" else 1.0 / self.eta

    def compute_side_inertias(self, ratio: float, *, driving: bool = True) -> tuple[float, float]:
        """Inertias before and behind the output shaft, at the shaft [kg m^2], in a gear.

        `ratio` is the overall one of the gear; `driving` is True if power flows from the engine.
        The drums of open elements are left out.
        """
        engine = self.J1 * self.get_efficiency(driving=driving) + self.J2e
        return engine * ratio**2 + self.J_out, self.J_v / self.i_f**2

    def compute_steady_torque(
        self, engine_torque: float, ratio: float, wheel_speed: float
    ) -> float:
        """Torque of the output shaft [N m] at which both of its sides accelerate alike.

        Eqs. 10 and 11 with equal accelerations and φ(T_g) by the loss law, in the gear of overall
        ratio `ratio`, from the engine's torque [N m] and the wheel's speed [rad/s] of either sign.
        """
        load = self.load.evaluate(wheel_speed) / self.i_f
        before, behind = self.compute_side_inertias(ratio)
        rate = (self.eta * engine_torque * ratio - load) / (before + behind)
        # T_g = T_e - J1·ω_e': its sign is the same whichever way the power is taken to flow.
        driving = (engine_torque - self.J1 * ratio * rate) * ratio * wheel_speed >= 0.0
        before, behind = self.compute_side_inertias(ratio, driving=driving)
        drive = self.get_efficiency(driving=driving) * engine_torque * ratio
        return load + behind * (drive - load) / (before + behind)


def compute_series_inertia(one: float, other: float) -> float:
    """Inertia [kg m^2] with which two swing against each other, 1/J = 1/J4 + 1/J5."""
    return one * other / (one + other)


@dataclass(frozen=True)
class State:
    """Start of a simulation: speeds [rad/s] and shaft twist [rad]; elements that start locked.

    Raises InputError for what are no numbers.
    """

    engine_speed: float
    output_speed: float
    wheel_speed: float
    twist: float
    locked: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("engine_speed", "output_speed", "wheel_speed", "twist"):
            require_number(name, getattr(self, name), finite=False)


@dataclass(frozen=True, eq=False)
class Signal:
    """An input, linear between its samples; `time` (n,) [s], `values` (n,) SI, n > 1.

    The input at time t is the sample of time t - `delay` [s]. Raises InputError for anything but
    finite numbers, and where time decreases.
    """

    time: FloatArray
    values: FloatArray
    delay: float = 0.0

    def __post_init__(self) -> None:
        require_samples(self.time, self.values, self.delay)
        for name in ("time", "values"):  # lists and series are taken as well
            object.__setattr__(self, name, as_array(getattr(self, name)))

    @property
    def arrival(self) -> FloatArray:
        """Times (n,) [s] at which the values act: those of the samples, later by `delay`."""
        return as_array(self.time) + self.delay


@dataclass(frozen=True)
class Accuracy:
    """Accuracy settings of the integration.

    By default samples without events are passed by exact operators, slipping torques being cubics
    in time: an error of a few 1e-3 N·m on 1 ms samples. `exact` integrates to round-off instead, as
    does an energy audit. `tolerance` is the truncation error allowed per step relative to the
    states (1e-10 at least unless `exact`, for networks that operators pass), finite and positive;
    `max_step` [s] the longest step, positive, inf for no limit; `order` a fixed order from 1 to 14
    in place of one that follows the tolerance (it implies `exact`): nothing but a finite `max_step`
    then keeps the error small. Raises InputError for other numbers.
    """

    exact: bool = False
    tolerance: float = 1e-12
    max_step: float = float("inf")
    order: int | None = None

    def __post_init__(self) -> None:
        if not 0.0 < require_number("tolerance", self.tolerance, finite=False) < math.inf:
            fault, remedy = f"tolerance is {self.tolerance!r}", "give a finite positive number"
        elif not require_number("max_step", self.max_step, finite=False) > 0.0:
            fault, remedy = f"max_step is {self.max_step!r}", "give a positive time [s], or inf"
        elif self.order is not None and not (
            isinstance(self.order, int | np.integer) and self.order in ORDERS
        ):
            fault = f"order is {require_number('order', self.order, finite=False):g}"
            remedy = f"give an integer from {ORDERS[0]} to {ORDERS[-1]}, or None"
        elif self.order is not None and math.isinf(self.max_step):
            fault = f"order is {self.order} and max_step inf: nothing limits the error of a step"
            remedy = "give a finite max_step [s] with it"
        else:
            return
        raise InputError(f"accuracy: {fault}", remedy)

    @property
    def sprint(self) -> bool:
        """True if several samples without events may be passed at once."""
        return not self.exact and self.order is None


@dataclass(frozen=True)
class Event:
    """A change of friction mode: `kind` is lock, break_away, reverse, fill, vent or impulse.

    An impulse at the start of a run loses `energy` [J] in its element; other kinds lose none.
    """

    time: float
    element: str
    kind: str
    energy: float = 0.0


@dataclass(frozen=True)
class EnergyAudit:
    """Work over the run [J]: source = stored + friction + gear_loss + shaft + load +
    converter + impulse + error.

    `impulse` is lost where the start of the run stops elements or sets speeds at once; the events
    of this kind have its parts. `gear_loss` is negative where the `paper` law creates energy;
    `created` is the sum of those negative parts, as a positive number.
    """

    source: float
    stored: float
    friction: float
    gear_loss: float
    shaft: float
    load: float
    converter: float
    impulse: float
    created: float
    error: float


@dataclass(frozen=True, eq=False)
class Trajectory:
    """Result of one run. Arrays (n,) on `time`; `clutch_torque` and `slip` by element name.

    A run that fails keeps its length: NaN after the failure, and `status` is the cause
    (`completed` otherwise). `crank_speed` is that of an engine in front of an input shaft or
    converter, None where there is neither.
    """

    time: FloatArray
    engine_speed: FloatArray
    output_speed: FloatArray
    wheel_speed: FloatArray
    twist: FloatArray
    shaft_torque: FloatArray
    clutch_torque: Mapping[str, FloatArray]
    slip: Mapping[str, FloatArray]
    events: tuple[Event, ...]
    status: str
    audit: EnergyAudit | None = field(default=None)
    crank_speed: FloatArray | None = None


def collect_inputs(engine_torque: Signal, pressures: Mapping[str, Signal]) -> dict[str, Signal]:
    """Collect the inputs of a dual clutch by their names in the core.

    Raises InputError where an element has the name of the engine's torque.
    """
    if ENGINE_TORQUE in pressures:
        raise InputError(
            f"a shift element is called {ENGINE_TORQUE!r}, as the engine's torque is",
            "give the element another name",
        )
    return {ENGINE_TORQUE: engine_torque, **pressures}


def to_core_samples(inputs: Mapping[str, Signal]) -> list[CoreSamples]:
    """Inputs as the core takes them: name, times [s] at which the values act, values, no delay."""
    return [
        (name, as_array(one.arrival), as_array(one.values), 0.0) for name, one in inputs.items()
    ]


def to_delayed_core_samples(inputs: Mapping[str, Signal]) -> list[CoreSamples]:
    """Inputs whose delays the core differentiates by: name, sample times [s], values, delay [s]."""
    return [
        (name, as_array(one.time), as_array(one.values), one.delay) for name, one in inputs.items()
    ]


def require_delays(inputs: Mapping[str, Signal], by: Sequence[str]) -> None:
    """Raise InputError where `by` names the delay of an input that jumps.

    The core moves values by their rates, and a jump has none: the derivative would lack it.
    """
    for name, one in inputs.items():
        jumps = np.flatnonzero(np.diff(one.time) == 0.0)
        if jumps.size and f"delay.{name}" in by:
            raise InputError(
                f"input {name!r} jumps at {one.time[jumps[0]]:.9g} s: there is no derivative by "
                "its delay",
                "give the jump a width, such as that of a sample",
            )


def run_time(time: FloatArray) -> FloatArray:
    """Return the time (n,) [s] of a run as the core takes it.

    Raises InputError where it lies beyond LATEST.
    """
    grid = as_array(time)
    farthest = float(np.max(np.abs(grid), initial=0.0))
    if LATEST < farthest < math.inf:
        raise InputError(
            f"time reaches {farthest:.6g} s from zero, too far for a simulation",
            f"let the time of run and inputs count from the start, or lie within {LATEST:g} s",
        )
    return grid
