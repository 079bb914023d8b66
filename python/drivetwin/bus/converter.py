# SPDX-License-Identifier: MIT
"""Torque converter ahead of the gearbox, detected by the slip of engine against turbine in gear.

A friction clutch slips for seconds only while the vehicle starts, and is closed before the next
shift. An engine that is faster than the turbine for seconds in a gear drives a converter.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from drivetwin._util.arrays import FloatArray, Span, find_true_runs
from drivetwin.bus.phases import CLOSED, SETTINGS, sample_speeds
from drivetwin.bus.recording import BusLog
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.shifts.candidate import Run, detect_gear_runs
from drivetwin.shifts.shift import GearboxSpeeds

CONVERTER_SLIP = 2.0
"""Shortest slip in a gear [s] that counts as a converter: the clutch of a heavy truck closes within
about a second after a shift."""
_START = 1.0
"""Slip over the input speed from which a slip begins near standstill: the input turns at less than
half of the engine speed [ratio]."""
_ENGINE = ("engine_speed", "engine_torque")
"""Signals that stand for the gearbox input only with a closed clutch."""


def set_converter_aside(
    logs: Sequence[BusLog], ratios: Mapping[str, float]
) -> tuple[list[BusLog], list[Finding]]:
    """Leave out engine speed and engine torque of all logs of a vehicle if it has a converter.

    Returns the logs and, with a converter, a finding with the longest slip.
    """
    found = [one for log in logs for one in _find_slips(log, ratios)]
    if not found:
        return list(logs), []
    log, gear, span, slip = max(found, key=lambda one: one[2][1] - one[2][0])
    shown = {"slip": Number(slip, "rad/s"), "start": Number(span[0]), "end": Number(span[1])}
    finding = report(Code.BUS_CONVERTER, log.label, gear=gear, **shown)
    return [drop_engine(one) for one in logs], [finding]


def drop_engine(log: BusLog) -> BusLog:
    """Return the log of a vehicle with a converter, without the signals of its engine."""
    signals = {role: one for role, one in log.signals.items() if role not in _ENGINE}
    return replace(log, signals=signals, converter=True)


def _find_slips(
    log: BusLog, ratios: Mapping[str, float]
) -> Iterator[tuple[BusLog, str, Span, float]]:
    """Yield gear, span [s] and median slip [rad/s] of each slip that no clutch has."""
    engine = log.signals.get("engine_speed")
    if engine is None or engine is log.signals["input_speed"] or engine.time.size < 2:
        return
    for stretch in log.stretches:
        first, last = max(stretch[0], engine.time[0]), min(stretch[1], engine.time[-1])
        speeds = sample_speeds(log, (float(first), float(last)), 0.0)
        if not speeds.time.size:
            continue
        slip = engine.interpolate(speeds.time) - speeds.input
        for run in detect_gear_runs(speeds, ratios, SETTINGS):
            if run.gear is None:
                continue
            inside = slice(run.first, run.last + 1)
            for begin, stop in find_true_runs(slip[inside] > CLOSED * speeds.input[inside]):
                part = slice(run.first + begin, run.first + stop)
                time = speeds.time[part]
                long = time[-1] - time[0] >= CONVERTER_SLIP
                if long and not _is_start(speeds, slip, run, part):
                    span = float(time[0]), float(time[-1])
                    yield log, run.gear, span, float(np.median(slip[part]))


def _is_start(speeds: GearboxSpeeds, slip: FloatArray, run: Run, part: slice) -> bool:
    """Return True for a slip from standstill that ends in lock-up, or with the motion or record."""
    standing = speeds.output <= SETTINGS.min_output_speed
    first, after = part.start, run.last + 1
    starts = first == 0 or standing[first - 1] or slip[first] > _START * speeds.input[first]
    ends = part.stop < after or after == standing.size or standing[after]
    return bool(starts and ends)
