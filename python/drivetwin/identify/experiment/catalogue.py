# SPDX-License-Identifier: MIT
"""Candidate experiments: each is the shift of the log with other inputs.

An experiment needs no new description of vehicle or sensors: rates, noise and start are those of
the log, only engine torque, pressures and duration differ.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from drivetwin.driveline import Signal
from drivetwin.identify.likelihood.problem import Part
from drivetwin.identify.likelihood.record import LATEST, Output, Record
from drivetwin.identify.optimize.objective import Point
from drivetwin.identify.signals import FloatArray

STEPS = (1.0, 1.3, 0.5, 1.2, 0.4, 1.1, 0.8, 1.0)
"""Levels of the throttle steps, in shares of the largest engine torque of the log over 1.3."""
DWELL = 0.4
"""Time at one level of the throttle steps [s]."""
COAST = (6.0, -0.1)
"""Length of a coast-down [s] and its engine torque in shares of the largest of the log."""
TORQUE_LEVEL = 0.6
"""Second torque level of a shift, in shares of the first."""
FIRMER, SOFTER = 1.3, 0.85
"""Pressures above P0 of the on-coming element, in shares of those of the log."""


class Experiment(StrEnum):
    """Kinds of recordings that can follow a log."""

    AGAIN = "the same shift again"
    THROTTLE_STEPS = "throttle steps in the lower gear"
    TORQUE_LEVEL = "a shift at 60 % of the engine torque"
    COAST_DOWN = "a coast-down of 6 s in gear"
    FIRMER = "the shift with 30 % more pressure"
    SOFTER = "the shift with 15 % less pressure, so that it slips longer"
    STILL_PEDAL = "the shift with the engine torque held still after lock-up"


@dataclass(frozen=True, eq=False)
class Base:
    """Shift that an experiment starts from: its part of the fit at the minimum, its lock-up [s]."""

    part: Part
    point: Point
    lockup: float

    @property
    def record(self) -> Record:
        """Recorded data of the shift."""
        return self.part.record

    @property
    def largest(self) -> float:
        """Largest engine torque of the log [N m]."""
        return float(np.max(np.abs(self.record.steady_torque.values)))


@dataclass(frozen=True, eq=False)
class Planned:
    """An experiment as a part of a fit, with a start of its own at `point`."""

    experiment: Experiment
    part: Part
    point: Point


def planned(experiment: Experiment, base: Base) -> Planned:
    """Build an experiment that starts like the log; its outputs hold no measurements."""
    part, point = base.part, base.point
    label = "next"
    starts = [name for name in point.names if name.startswith(f"{part.structure.label}.")]
    renamed = [f"{label}.{name.rpartition('.')[2]}" for name in starts]
    values = np.concatenate([point.values, [point[name] for name in starts]])
    extended = Point((*point.names, *renamed), values)
    structure = replace(part.structure, label=label)
    record = _RECORDS[experiment](base)
    return Planned(experiment, Part.unweighted(structure, record), extended)


def _again(base: Base) -> Record:
    return base.record


def _throttle_steps(base: Base) -> Record:
    largest = base.largest / max(STEPS)
    ends = DWELL * np.arange(len(STEPS) + 1)
    time = np.sort(np.concatenate([ends[:-1], ends[1:] - 0.06]))
    return _in_gear(base, Signal(time, np.repeat(largest * np.array(STEPS), 2)), float(ends[-1]))


def _coast_down(base: Base) -> Record:
    length, share = COAST
    time = np.array([0.0, 0.1, 0.3, length])
    first = float(np.interp(base.record.time[0], *_samples(base.record.engine_torque)))
    closed = share * base.largest
    return _in_gear(base, Signal(time, np.array([first, first, closed, closed])), length)


def _torque_level(base: Base) -> Record:
    elements = base.part.structure.elements
    scaled = _scaled(base, {one.name: TORQUE_LEVEL for one in elements})
    return _with_torque(scaled, lambda _, values: TORQUE_LEVEL * values)


def _firmer(base: Base) -> Record:
    return _scaled(base, {base.part.structure.driveline.oncoming.name: FIRMER})


def _softer(base: Base) -> Record:
    return _scaled(base, {base.part.structure.driveline.oncoming.name: SOFTER})


def _still_pedal(base: Base) -> Record:
    def held(time: FloatArray, values: FloatArray) -> FloatArray:
        return np.where(time > base.lockup, np.interp(base.lockup, time, values), values)

    return _with_torque(base.record, held)


_RECORDS: Mapping[Experiment, Callable[[Base], Record]] = {
    Experiment.AGAIN: _again,
    Experiment.THROTTLE_STEPS: _throttle_steps,
    Experiment.TORQUE_LEVEL: _torque_level,
    Experiment.COAST_DOWN: _coast_down,
    Experiment.FIRMER: _firmer,
    Experiment.SOFTER: _softer,
    Experiment.STILL_PEDAL: _still_pedal,
}


def _samples(signal: Signal) -> tuple[FloatArray, FloatArray]:
    return signal.time, signal.values


def _scaled(base: Base, factors: Mapping[str, float]) -> Record:
    """Multiply the pressures above P0 of some elements."""
    pressures = dict(base.record.pressures)
    for name, factor in factors.items():
        P0 = base.part.structure.value(base.point, f"{name}.P0")
        signal = pressures[name]
        values = np.where(signal.values > P0, P0 + factor * (signal.values - P0), signal.values)
        pressures[name] = Signal(signal.time, values)
    return replace(base.record, pressures=pressures)


def _with_torque(record: Record, change: Callable[[FloatArray, FloatArray], FloatArray]) -> Record:
    """Change the engine torque by a function of time [s] and torque [N m]."""
    torque, steady = (
        Signal(signal.time, change(signal.time, signal.values))
        for signal in (record.engine_torque, record.steady_torque)
    )
    return replace(record, engine_torque=torque, steady_torque=steady)


def _in_gear(base: Base, demand: Signal, length: float) -> Record:
    """Build a record of the off-going element's gear alone, with the rates and noise of the log."""
    record, driveline = base.record, base.part.structure.driveline
    step = float(np.median(np.diff(record.time)))
    time = step * np.arange(int(length / step), dtype=np.float64)
    period = float(np.median(np.diff(record.engine_torque.time)))
    stamps = np.arange(-2.0 * LATEST, length + 2.0 * LATEST, period)
    torque = Signal(stamps, np.interp(stamps, demand.time, demand.values))
    ends = np.array([0.0, length])
    closed = float(np.max(record.pressures[driveline.offgoing.name].values))
    raster = {name: float(np.median(np.diff(p.time))) for name, p in record.pressures.items()}
    levels = {driveline.offgoing.name: closed, driveline.oncoming.name: 0.0}
    pressures = {
        name: _held(np.append(np.arange(0.0, length, raster[name]), ends[1]), level)
        for name, level in levels.items()
    }
    return Record(
        time,
        torque,
        pressures,
        tuple(_blank(out, record.time, time) for out in record.outputs),
        torque,
        np.zeros(torque.time.size),
        record.input_sigma,
    )


def _held(time: FloatArray, level: float) -> Signal:
    return Signal(time, np.full(time.size, level))


def _blank(out: Output, before: FloatArray, time: FloatArray) -> Output:
    """Build the same sensor on another grid, without measurements."""
    period = float(np.median(np.diff(before[out.place])))
    stride = max(1, round(period / float(time[1] - time[0])))
    place = np.arange(0, time.size, stride)
    fresh = Output(out.name, place, np.zeros(place.size), out.sigma)
    return fresh if out.window == 0.0 else fresh.after_period(time).averaged(time)
