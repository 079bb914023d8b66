# SPDX-License-Identifier: MIT
"""Candidate experiments: each is the shift of the log with other inputs.

An experiment needs no new description of vehicle or sensors: rates, noise and start are those of
the log, only engine torque, pressures and duration differ.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.data.output import Output
from drivetwin.estimation.likelihood.data.shift_record import RECORD, ShiftRecord
from drivetwin.estimation.likelihood.shift_objective import ShiftTerm
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.estimation.result.suggestion import FIRMER, SOFTER, TORQUE_LEVEL, Experiment
from drivetwin.simulation.dual_clutch import Signal

STEPS = (1.0, 1.3, 0.5, 1.2, 0.4, 1.1, 0.8, 1.0)
"""Levels of the throttle steps, in shares of the largest engine torque of the log over 1.3."""
DWELL = 0.4
"""Time at one level of the throttle steps [s]."""
COAST = (6.0, -0.1)
"""Length of a coast-down [s] and its engine torque in shares of the largest of the log."""


@dataclass(frozen=True, eq=False)
class BaseShift:
    """Shift that an experiment starts from: its part of the fit at the minimum, its lock-up [s]."""

    part: ShiftTerm
    point: ParameterVector
    lockup: float

    @property
    def record(self) -> ShiftRecord:
        """Recorded data of the shift."""
        return self.part.record

    @property
    def largest(self) -> float:
        """Largest engine torque of the log [N m]."""
        return float(np.max(np.abs(self.record.steady_torque.values)))


@dataclass(frozen=True, eq=False)
class ExperimentPlan:
    """An experiment as a part of a fit, with a start of its own at `point`."""

    experiment: Experiment
    part: ShiftTerm
    point: ParameterVector


def plan_experiment(experiment: Experiment, base: BaseShift) -> ExperimentPlan:
    """Build an experiment that starts like the log; its outputs hold no measurements."""
    part, point = base.part, base.point
    label = "next"
    starts = [name for name in point.names if name.startswith(f"{part.structure.label}.")]
    renamed = [f"{label}.{name.rpartition('.')[2]}" for name in starts]
    values = np.concatenate([point.values, [point[name] for name in starts]])
    extended = ParameterVector((*point.names, *renamed), values)
    structure = replace(part.structure, label=label)
    record = _RECORDS[experiment](base)
    return ExperimentPlan(experiment, ShiftTerm.from_sensor_noise(structure, record), extended)


def _repeat_shift(base: BaseShift) -> ShiftRecord:
    return base.record


def _build_throttle_steps(base: BaseShift) -> ShiftRecord:
    largest = base.largest / max(STEPS)
    ends = DWELL * np.arange(len(STEPS) + 1)
    time = np.sort(np.concatenate([ends[:-1], ends[1:] - 0.06]))
    return _build_gear_record(
        base, Signal(time, np.repeat(largest * np.array(STEPS), 2)), float(ends[-1])
    )


def _build_coast_down(base: BaseShift) -> ShiftRecord:
    length, share = COAST
    time = np.array([0.0, 0.1, 0.3, length])
    first = float(np.interp(base.record.time[0], *_get_samples(base.record.engine_torque)))
    closed = share * base.largest
    return _build_gear_record(base, Signal(time, np.array([first, first, closed, closed])), length)


def _build_torque_level(base: BaseShift) -> ShiftRecord:
    elements = base.part.structure.elements
    scaled = _scale_pressures(base, {one.name: TORQUE_LEVEL for one in elements})
    return _replace_torque(scaled, lambda _, values: TORQUE_LEVEL * values)


def _build_firmer_shift(base: BaseShift) -> ShiftRecord:
    return _scale_pressures(base, {base.part.structure.driveline.oncoming.name: FIRMER})


def _build_softer_shift(base: BaseShift) -> ShiftRecord:
    return _scale_pressures(base, {base.part.structure.driveline.oncoming.name: SOFTER})


def _build_still_pedal(base: BaseShift) -> ShiftRecord:
    def held(time: FloatArray, values: FloatArray) -> FloatArray:
        return np.where(time > base.lockup, np.interp(base.lockup, time, values), values)

    return _replace_torque(base.record, held)


_RECORDS: Mapping[Experiment, Callable[[BaseShift], ShiftRecord]] = {
    Experiment.AGAIN: _repeat_shift,
    Experiment.THROTTLE_STEPS: _build_throttle_steps,
    Experiment.TORQUE_LEVEL: _build_torque_level,
    Experiment.COAST_DOWN: _build_coast_down,
    Experiment.FIRMER: _build_firmer_shift,
    Experiment.SOFTER: _build_softer_shift,
    Experiment.STILL_PEDAL: _build_still_pedal,
}


def _get_samples(signal: Signal) -> tuple[FloatArray, FloatArray]:
    return signal.time, signal.values


def _scale_pressures(base: BaseShift, factors: Mapping[str, float]) -> ShiftRecord:
    """Multiply the pressures above P0 of some elements."""
    pressures = dict(base.record.pressures)
    for name, factor in factors.items():
        P0 = base.part.structure.get_value(base.point, f"{name}.P0")
        signal = pressures[name]
        values = np.where(signal.values > P0, P0 + factor * (signal.values - P0), signal.values)
        pressures[name] = Signal(signal.time, values)
    return replace(base.record, pressures=pressures)


def _replace_torque(
    record: ShiftRecord, change: Callable[[FloatArray, FloatArray], FloatArray]
) -> ShiftRecord:
    """Change the engine torque by a function of time [s] and torque [N m]."""
    torque, steady = (
        Signal(signal.time, change(signal.time, signal.values))
        for signal in (record.engine_torque, record.steady_torque)
    )
    return replace(record, engine_torque=torque, steady_torque=steady)


def _build_gear_record(base: BaseShift, demand: Signal, length: float) -> ShiftRecord:
    """Build a record of the off-going element's gear alone, with the rates and noise of the log."""
    record, driveline = base.record, base.part.structure.driveline
    step = float(np.median(np.diff(record.time)))
    time = step * np.arange(int(length / step), dtype=np.float64)
    period = float(np.median(np.diff(record.engine_torque.time)))
    stamps = np.arange(-2.0 * RECORD.max_delay, length + 2.0 * RECORD.max_delay, period)
    torque = Signal(stamps, np.interp(stamps, demand.time, demand.values))
    ends = np.array([0.0, length])
    closed = float(np.max(record.pressures[driveline.offgoing.name].values))
    raster = {name: float(np.median(np.diff(p.time))) for name, p in record.pressures.items()}
    levels = {driveline.offgoing.name: closed, driveline.oncoming.name: 0.0}
    pressures = {
        name: _make_constant(np.append(np.arange(0.0, length, raster[name]), ends[1]), level)
        for name, level in levels.items()
    }
    return ShiftRecord(
        time,
        torque,
        pressures,
        tuple(_make_empty_output(out, record.time, time) for out in record.outputs),
        torque,
        np.zeros(torque.time.size),
        record.input_sigma,
    )


def _make_constant(time: FloatArray, level: float) -> Signal:
    return Signal(time, np.full(time.size, level))


def _make_empty_output(out: Output, before: FloatArray, time: FloatArray) -> Output:
    """Build the same sensor on another grid, without measurements."""
    period = float(np.median(np.diff(before[out.place])))
    stride = max(1, round(period / float(time[1] - time[0])))
    place = np.arange(0, time.size, stride)
    fresh = Output(out.name, place, np.zeros(place.size), out.sigma)
    return fresh if out.window == 0.0 else fresh.drop_first_period(time).convert_to_means(time)
