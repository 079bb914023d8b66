# SPDX-License-Identifier: MIT
"""Vehicle of a synthetic log to which effects are applied, one after the other."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray, apply_low_pass, integrate_trapezoids
from drivetwin.simulation.added_elements import NO_ADDED_ELEMENTS, AddedElements
from drivetwin.simulation.driveline import settle
from drivetwin.simulation.driveline_run import DrivelineTask
from drivetwin.simulation.dual_clutch import (
    DualClutch,
    ShiftElement,
    Signal,
    State,
    Trajectory,
)

_LEAST_SLIP = 1e-6
"""Slip [rad/s] above the round-off of a locked element."""


@dataclass(frozen=True, eq=False)
class NominalRun:
    """Motion without effects, and its inputs: engine torque [N m] and pressures [Pa].

    The sizes of effects are related to its torques, speeds and friction work.
    """

    model: DualClutch
    trajectory: Trajectory
    engine_torque: Signal
    pressures: Mapping[str, Signal]

    @property
    def largest_engine_torque(self) -> float:
        """Largest magnitude of the engine torque, T0 [N m]."""
        return float(np.max(np.abs(self.engine_torque.values)))

    @property
    def largest_shaft_torque(self) -> float:
        """Largest magnitude of the output shaft's torque, FS [N m]."""
        return float(np.max(np.abs(self.trajectory.shaft_torque)))

    @property
    def mean_wheel_speed(self) -> float:
        """Mean speed of the wheel [rad/s]."""
        time = self.trajectory.time
        distance = float(np.trapezoid(self.trajectory.wheel_speed, time))
        return distance / float(time[-1] - time[0])

    @property
    def load(self) -> float:
        """Load at the wheel at its mean speed, L [N m]."""
        return self.model.load.evaluate(self.mean_wheel_speed)

    def get_largest_slip(self, element: str) -> float:
        """Return the largest magnitude of the slip at which the element transmits torque
        [rad/s]."""
        slip = self.trajectory.slip[element][self._find_slipping(element)]
        return float(np.max(np.abs(slip), initial=0.0))

    def get_pressure_range(self, element: str, P0: float) -> float:
        """Return the largest pressure above `P0` at which the element slips [Pa]."""
        signal = self.pressures[element]
        pressure = np.interp(self.trajectory.time, signal.arrival, signal.values)
        return float(np.max(pressure[self._find_slipping(element)] - P0, initial=0.0))

    def _find_slipping(self, element: str) -> NDArray[np.bool_]:
        run = self.trajectory
        moving = np.abs(run.slip[element]) > _LEAST_SLIP
        return np.asarray(moving & (run.clutch_torque[element] != 0.0))


def compute_friction_work(run: Trajectory, element: str) -> FloatArray:
    """Compute the friction work of an element from the start on (n,) [J]."""
    power: FloatArray = np.abs(run.clutch_torque[element] * run.slip[element])
    return integrate_trapezoids(power, run.time)


FILTER_STEP = 2.5e-4
"""Raster [s] of a filtered torque: a twelfth of the usual delay of a filter."""


def filter_torque(time: FloatArray, torque: FloatArray, delay: float) -> FloatArray:
    """Filter a torque (n,) at the instants `time` (n,) [s] by a Butterworth of order 2 that delays
    slow changes by `delay` [s]; one below the raster filters nothing."""
    if delay < FILTER_STEP:
        return torque
    raster = np.arange(time[0], time[-1] + FILTER_STEP, FILTER_STEP)
    cutoff = np.sqrt(2.0) / (2.0 * np.pi * delay)
    return np.interp(
        time, raster, apply_low_pass(np.interp(raster, time, torque), FILTER_STEP, cutoff)
    )


@dataclass(frozen=True, eq=False)
class SensorErrors:
    """Errors of recorded outputs.

    Those of the output torque are `offset` and `drift` [N m], `delay` [s] and `curve` [1/(N m)],
    an error in proportion to the square of the torque, and `filter_delay` [s], that of a low-pass
    filter. `run_out` is the amplitude of the error of
    the speed at the engine once per turn, over the speed.
    """

    offset: float = 0.0
    drift: Signal | None = None
    delay: float = 0.0
    curve: float = 0.0
    run_out: float = 0.0
    filter_delay: float = 0.0

    def compute(
        self, role: str, stamps: FloatArray, exact: FloatArray, run: Trajectory
    ) -> FloatArray:
        """Compute the error (n,) of a channel with `exact` values (n,) at its `stamps` (n,) [s] in
        a run; 0 for other roles.

        The delay is not part of it.
        """
        if role in ("input_speed", "engine_speed"):
            angle = integrate_trapezoids(run.engine_speed, run.time)
            return np.asarray(self.run_out * exact * np.sin(np.interp(stamps, run.time, angle)))
        if role != "output_torque":
            return np.zeros_like(stamps)
        drift = self.drift
        walk = 0.0 if drift is None else np.interp(stamps, drift.time, drift.values)
        torque = run.shaft_torque
        filtered = filter_torque(run.time, torque, self.filter_delay) - torque
        lost = np.interp(stamps, run.time, filtered)
        return np.asarray(self.offset + walk + self.curve * exact * np.abs(exact) + lost)


@dataclass(frozen=True, eq=False)
class SyntheticVehicle:
    """Vehicle of a scenario with the effects applied so far.

    `nominal` is the run without effects, `gears` are the shift elements in the order of the gears,
    `seed` is that of the random effects. `model` and `added` describe the vehicle, `engine_torque`
    [N m] and `pressures` [Pa] act on it, `errors` are those of the sensors. Friction
    depends on the work of the run `heated`, which has the times of the nominal one.
    """

    nominal: NominalRun
    gears: Sequence[str]
    seed: int
    model: DualClutch
    engine_torque: Signal
    pressures: Mapping[str, Signal]
    heated: Trajectory
    added: AddedElements = NO_ADDED_ELEMENTS
    errors: SensorErrors = SensorErrors()

    @classmethod
    def from_nominal(
        cls, nominal: NominalRun, gears: Sequence[str], seed: int, heated: Trajectory | None = None
    ) -> SyntheticVehicle:
        """Build the vehicle without effects; friction work is that of the nominal run unless
        `heated` is given."""
        inputs = (nominal.engine_torque, nominal.pressures)
        return cls(nominal, gears, seed, nominal.model, *inputs, heated or nominal.trajectory)

    def replace_elements(self, elements: Sequence[ShiftElement]) -> SyntheticVehicle:
        """Return the vehicle with other shift elements."""
        return replace(self, model=replace(self.model, elements=tuple(elements)))

    def scale_friction(self, factors: Mapping[str, FloatArray]) -> SyntheticVehicle:
        """Return the vehicle whose friction is multiplied by factors (n,) at the pressure samples.

        The capacity is μ·gain·(P - P0), so a factor of μ acts as the same factor of P - P0.
        """
        pressures = dict(self.pressures)
        for one in self.model.elements:
            acting = pressures[one.name]
            above = self.get_pressure_above(one)
            values = acting.values + (factors.get(one.name, 1.0) - 1.0) * above
            pressures[one.name] = Signal(acting.time, values, acting.delay)
        return replace(self, pressures=pressures)

    def get_pressure_above(self, element: ShiftElement) -> FloatArray:
        """Return the pressure (n,) above P0 of an element [Pa], 0 below it."""
        return np.asarray(np.maximum(self.pressures[element.name].values - element.P0, 0.0))

    def simulate(self, start: State, time: FloatArray) -> Trajectory:
        """Simulate on `time` (n,) [s]; a failed run returns its status.

        Of `start` the speeds and the locked element hold, the rest is that of quasi-steady
        acceleration. Raises InputError where the description is inconsistent.
        """
        return self.build_task(start, time).simulate()

    def build_task(self, start: State, time: FloatArray) -> DrivelineTask:
        """Build the run of `simulate`."""
        settled = settle(self.model, self.added, start, self.engine_torque, float(time[0]))
        given = (self.engine_torque, self.pressures, settled, time)
        return DrivelineTask(self.model, self.added, *given)
