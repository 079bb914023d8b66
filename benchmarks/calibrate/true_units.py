# SPDX-License-Identifier: MIT
"""Units made like a true vehicle, with its effects: shifts with profiles, and logs of them."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from benchmarks.calibrate.true_vehicle import MadeVehicle
from benchmarks.estimation.vehicles import draw_errors, misread_channels
from drivetwin.calibration.evaluate import Plant
from drivetwin.calibration.maneuver import Control, Maneuver, OperatingPoint, Profiles
from drivetwin.calibration.metrics import Metric, Outcome
from drivetwin.calibration.scenarios import Scenarios, collect_scenarios, scale_units
from drivetwin.calibration.spread import Spread
from drivetwin.channels.roles import get_command_element
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.dyno.dyno import Motion, list_sampling_instants, record_channels
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import (
    SensorErrors,
    SyntheticVehicle,
)
from drivetwin.logs.read import read_log
from drivetwin.logs.write import convert_to_recorded_units, write_log
from drivetwin.simulation.driveline import Driveline
from drivetwin.simulation.dual_clutch import Signal

_BEFORE, _AFTER = 1.5, 1.0
"""Time of a log before and after the maneuver [s]."""
_METRICS = (Metric.PEAK_JERK, Metric.SHIFT_TIME)


@dataclass(frozen=True, eq=False)
class TrueUnits:
    """Made units around a true vehicle, with its effects; `shift` has the operating point."""

    made: MadeVehicle
    shift: Maneuver
    units: Sequence[SyntheticVehicle]
    drawn: dict[float, Scenarios] = field(init=False, default_factory=dict, repr=False)
    """Units in steady acceleration by engine torque [N m]: they start alike with every control."""

    def evaluate_all(self, controls: Sequence[Control]) -> list[Outcome]:
        """Return the metrics of each control over all units."""
        return [self.evaluate(one) for one in controls]

    def evaluate(self, control: Control) -> Outcome:
        """Return the metrics of profiles over all units, which run side by side."""
        assert isinstance(control, Profiles)
        shift, added = self.shift, self.units[0].added
        names = (shift.offgoing.name, shift.oncoming.name)
        true = follow_profiles(self.made, shift, control).sample(shift.time)
        pressures = dict(zip(names, (true.offgoing, true.oncoming), strict=True))
        acting = self.made.build_acting(true.engine_torque, pressures)
        torque = acting["engine_torque"]
        driving = float(torque.values[0]) - added.input_drag
        point = OperatingPoint(driving, shift.point.engine_speed)
        own = replace(shift, model=self.units[0].model, point=point, added=added)
        if driving not in self.drawn:
            drivelines = [Driveline(one.model, one.added) for one in self.units]
            self.drawn[driving] = collect_scenarios(own, drivelines)
        profiles = Profiles(torque, *(acting["pressures"][name] for name in names))
        plant = Plant(own, threads=1, metrics=_METRICS)
        return plant.evaluate(profiles, self.drawn[driving])


def draw_true_units(
    made: MadeVehicle, shift: Maneuver, spread: Spread, count: int, seed: int
) -> TrueUnits:
    """Draw `count` units around a true vehicle."""
    random = np.random.default_rng([made.seed, 43, seed])
    vehicle = made.vehicle
    drawn = [scale_units(vehicle.model, spread, random) for _ in range(count)]
    units = [replace(vehicle, model=replace(one, load=vehicle.model.load)) for one in drawn]
    return TrueUnits(made, replace(shift, model=made.scenario.model), units)


def follow_profiles(made: MadeVehicle, shift: Maneuver, wanted: Profiles) -> Profiles:
    """Return true torque and pressures of a bench whose sensors read the wanted ones.

    The bench follows the profiles by the sensors of the log, with their errors of gain and offset.
    """
    errors = draw_errors(made.seed, made.scenario)

    def invert(role: str, read: Signal) -> Signal:
        gain, offset = errors[role]
        return replace(read, values=(read.values - offset) / (1.0 + gain))

    def release(name: str, read: Signal) -> Signal:
        true = invert(f"pressure.{name}", read)
        return replace(true, values=np.maximum(true.values, 0.0))

    return Profiles(
        invert("engine_torque", wanted.engine_torque),
        release(shift.offgoing.name, wanted.offgoing),
        release(shift.oncoming.name, wanted.oncoming),
    )


def record_shift(made: MadeVehicle, shift: Maneuver, control: Profiles, seed: int) -> ShiftLog:
    """Record a shift of the true vehicle with profiles, by the sensors of its first log."""
    scenario = made.scenario
    sensors = [one for one in scenario.sensors if get_command_element(one.role) is None]
    true = replace(shift, model=scenario.model)
    rate = true.ratios[0] * true.compute_acceleration(shift.point.engine_torque, true.ratios[0])
    speed = shift.point.engine_speed - _BEFORE * rate
    early = replace(true, point=replace(true.point, engine_speed=speed))
    duration = _BEFORE + shift.horizon + _AFTER
    followed = follow_profiles(made, shift, control)
    inputs = {
        "engine_torque": _move(followed.engine_torque, duration, shift.step),
        f"pressure.{shift.offgoing.name}": _move(followed.offgoing, duration, shift.step),
        f"pressure.{shift.oncoming.name}": _move(followed.oncoming, duration, shift.step),
    }
    pressures = {one.name: inputs[f"pressure.{one.name}"] for one in true.model.elements}
    seen = list_sampling_instants(sensors, duration)
    run = made.simulate(early, inputs["engine_torque"], pressures, seen)
    error = SensorErrors()
    channels = record_channels(
        sensors, duration, Motion(run, scenario.model.i_in, inputs, error), 1.0, seed
    )
    read = misread_channels(channels, draw_errors(made.seed, scenario))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"bench-{seed}.csv"
        write_log(path, tuple(convert_to_recorded_units(one) for one in read))
        return read_log(path, made.twin.build_card())


def _move(signal: Signal, duration: float, step: float) -> Signal:
    """Move a signal to the request of a log, constant beyond its ends.

    It is sampled evenly: lags act on samples, and friction over pressure bends what is between.
    """
    time = step * np.arange(round((duration + 1.0) / step) + 1, dtype=np.float64)
    return Signal(time, np.interp(time, signal.arrival + _BEFORE, signal.values))
