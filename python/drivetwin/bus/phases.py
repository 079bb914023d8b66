# SPDX-License-Identifier: MIT
"""Gears held and shifts of a bus log, with the phases of an automated manual gearbox.

The clutch opens, the gearbox is in neutral, the next gear is synchronised and engaged, and the
clutch closes. Input over output speed shows the gear, engine less input speed the slip of the
clutch. Without an engine speed, only the time between the gears is seen. A record may begin or
end inside a shift.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray, Span, find_true_runs
from drivetwin.bus.recording import BusLog
from drivetwin.shifts.candidate import Run, detect_gear_runs
from drivetwin.shifts.shift import (
    GearboxSpeeds,
    ShiftSettings,
    find_held_ratios,
    merge_equal_ratios,
)

SETTINGS = ShiftSettings(ratio_tolerance=0.02)
"""Settings of the gears held. The tolerance is that of a ratio while the driveline swings."""
_MIN_SAMPLES = 20
"""Fewest samples of a stretch in which a gear is looked for: 0.2 s of a message of 10 ms, about the
shortest gear held."""
CLOSED = 0.02
"""Slip of the clutch over the input speed up to which it counts as closed [ratio]: as far as a
swinging driveline moves a ratio (`SETTINGS`)."""
_FLAG_REACH = 1.0
"""Longest time [s] between engaged gear and end of the shift flag that belong to one shift."""
_CLUSTER = 0.04
"""Relative distance of two gears that differ without a card; real steps are above 0.1."""


class PhaseName(StrEnum):
    """Phases of a shift of an automated manual gearbox."""

    CLUTCH_OPENS = "clutch opens"
    NEUTRAL = "neutral"
    BETWEEN_GEARS = "between gears"
    """Neutral, or slip of a power shift: the clutch is not recorded."""
    ENGAGED = "gear engaged"
    """Until the shift flag ends: the clutch is not recorded."""
    SYNCHRONISED = "synchronised"
    CLUTCH_CLOSES = "clutch closes"


@dataclass(frozen=True)
class HeldGear:
    """A gear held with closed clutch over `span` [s]."""

    gear: str
    span: Span


@dataclass(frozen=True)
class BusShift:
    """A shift between two gears; `start_gear` is empty where nothing shows it.

    `phases` are in order of time, without overlap. `lockup` [s] is the instant from which the
    clutch is closed in `end_gear`, None if the record ends before. `start_seen` is False where the
    record begins within the shift.
    """

    start_gear: str
    end_gear: str
    phases: tuple[tuple[PhaseName, Span], ...]
    lockup: float | None
    start_seen: bool

    @property
    def label(self) -> str:
        """Both gears and the time of lock-up."""
        gears = f"{self.start_gear or '?'}→{self.end_gear or '?'}"
        time = self.phases[-1][1][1] if self.lockup is None else self.lockup
        return f"{gears} at {time:.2f} s"

    def find_phase(self, name: PhaseName) -> Span | None:
        """Span [s] of a phase; None if the shift does not show it."""
        return dict(self.phases).get(name)


@dataclass(frozen=True, eq=False)
class Timeline:
    """Gears held and shifts of one log."""

    log: BusLog
    held: tuple[HeldGear, ...]
    shifts: tuple[BusShift, ...]


def sample_speeds(log: BusLog, span: Span, late: float) -> GearboxSpeeds:
    """Both gearbox speeds at the input samples in `span` [s]; the output is `late` [s]."""
    time, inlet = log.signals["input_speed"].select((span[0], span[1] - max(late, 0.0)))
    return GearboxSpeeds(time, inlet, log.signals["output_speed"].interpolate(time + late))


def find_timeline(log: BusLog, ratios: Mapping[str, float], late: Mapping[str, float]) -> Timeline:
    """Find gears held and shifts; `late` are the delays [s] behind the input speed, by role."""
    held: list[HeldGear] = []
    shifts: list[BusShift] = []
    for stretch in log.stretches:
        speeds = sample_speeds(log, stretch, late.get("output_speed", 0.0))
        if speeds.time.size < _MIN_SAMPLES:
            continue
        runs = _merge(detect_gear_runs(speeds, ratios, SETTINGS))
        part = _Part(log, speeds, ratios, late.get("engine_speed", 0.0))
        found = part.list_shifts(runs)
        shifts += found
        held += part.list_held(runs, found)
    return Timeline(log, tuple(held), tuple(shifts))


def _merge(runs: Sequence[Run]) -> list[Run]:
    """Join runs of one gear without those of no gear.

    A gear that slips and is held again does not change.
    """
    merged: list[Run] = []
    for run in runs:
        if run.gear is None:
            continue
        if merged and merged[-1].gear == run.gear:
            merged[-1] = Run(run.gear, merged[-1].first, run.last)
        else:
            merged.append(run)
    return merged


@dataclass(frozen=True, eq=False)
class _Slip:
    """Engine less input speed, and the input speed [rad/s], (n,) at `time` [s]."""

    time: FloatArray
    values: FloatArray
    inlet: FloatArray

    @property
    def is_open(self) -> NDArray[np.bool_]:
        """Samples (n,) at which the clutch slips."""
        return np.asarray(np.abs(self.values) > CLOSED * self.inlet)


@dataclass(frozen=True, eq=False)
class _Part:
    """A stretch without gaps; `engine_late` [s] is the delay of the engine speed."""

    log: BusLog
    speeds: GearboxSpeeds
    ratios: Mapping[str, float]
    engine_late: float

    def list_shifts(self, runs: Sequence[Run]) -> list[BusShift]:
        """Shifts between the gears held, and those that the record begins or ends in."""
        last = self.speeds.time.size - 1
        found = []
        if runs and runs[0].first > 0 and self._is_in_shift(0, runs[0].first):
            found.append(self._build(None, runs[0]))
        for before, after in pairwise(runs):
            if self._time(after.first) - self._time(before.last) <= SETTINGS.max_inertia_phase:
                found.append(self._build(before, after))
        if runs and runs[-1].last < last and self._is_in_shift(runs[-1].last, last):
            found.append(self._build(runs[-1], None))
        return found

    def list_held(self, runs: Sequence[Run], shifts: Sequence[BusShift]) -> list[HeldGear]:
        """Spans with a gear held and a closed clutch."""
        held = []
        for run in runs:
            start, end = self._time(run.first), self._time(run.last)
            for one in shifts:
                if one.end_gear == run.gear and one.phases[-1][1][0] <= end:
                    locked = end if one.lockup is None else one.lockup
                    if one.phases[0][1][0] < end and one.phases[-1][1][1] >= start:
                        start = max(start, min(locked, end))
                if one.start_gear == run.gear and start <= one.phases[0][1][0] < end:
                    end = one.phases[0][1][0]
            if end - start > SETTINGS.max_dropout:
                held.append(HeldGear(run.gear or "", (start, end)))
        return held

    def _time(self, index: int) -> float:
        return float(self.speeds.time[index])

    def _is_in_shift(self, first: int, last: int) -> bool:
        """Return True if a stretch beside a gear held is part of a shift, not a standstill."""
        moving = self.speeds.output[first : last + 1] > SETTINGS.min_output_speed
        long = self._time(last) - self._time(first)
        return bool(moving.all()) and SETTINGS.max_dropout < long <= SETTINGS.max_inertia_phase

    def _build(self, before: Run | None, after: Run | None) -> BusShift:
        first = 0 if before is None else before.last
        last = self.speeds.time.size - 1 if after is None else after.first
        leaves = self._time(first)
        if before is not None and before.gear is not None:
            leaves = self._find_change(before.gear, before.first, last, held_first=True)
        reaches = self._time(last)
        if after is not None and after.gear is not None:
            reaches = self._find_change(after.gear, first, after.last, held_first=False)
        reaches = max(reaches, leaves)
        start_gear = self.log.get_gear_value(self._time(0)) if before is None else before.gear
        end_gear = self.log.get_gear_value(self._time(last)) if after is None else after.gear
        end = self._time(after.last) if after is not None else self._time(last)
        lockup = None if after is None else self._find_lockup(reaches, end)
        phases = self._list_phases(leaves, reaches, lockup if lockup is not None else end)
        seen = before is not None
        same = not seen and start_gear == end_gear
        return BusShift("" if same else start_gear or "", end_gear or "", phases, lockup, seen)

    def _find_change(self, gear: str, first: int, last: int, *, held_first: bool) -> float:
        """Instant [s] at which a gear is left (`held_first`) or reached: fewest misfits."""
        part = self.speeds.select(first, last + 1)
        error = np.abs(part.compute_sync_error(self.ratios[gear]))
        inside = error < SETTINGS.ratio_tolerance * self.ratios[gear] * part.output
        score = np.concatenate([[0], np.cumsum(np.where(inside == held_first, 1, -1))])
        place = int(np.argmax(score))
        return float(part.time[min(place, part.time.size - 1)])

    def _compute_slip(self, start: float, end: float) -> _Slip | None:
        """Slip of the clutch from `start` to `end` [s]; None if no engine speed is recorded."""
        engine = self.log.signals.get("engine_speed")
        if engine is None or engine is self.log.signals["input_speed"] or engine.time.size < 2:
            return None
        first, last = engine.time[[0, -1]] - self.engine_late
        time = self.speeds.time
        inside = (time >= max(start, first)) & (time <= min(end, last))
        if not inside.any():
            return None
        fast = engine.interpolate(time[inside] + self.engine_late)
        return _Slip(time[inside], fast - self.speeds.input[inside], self.speeds.input[inside])

    def _find_lockup(self, reaches: float, end: float) -> float | None:
        """First instant [s] with a closed clutch; None if the record ends before."""
        slip = self._compute_slip(reaches, end)
        if slip is not None:
            for first, stop in find_true_runs(~slip.is_open):
                if slip.time[stop - 1] - slip.time[first] >= SETTINGS.max_dropout:
                    return float(slip.time[first])
            return None
        ends = [off for _, off in self.log.flags or () if 0.0 <= off - reaches <= _FLAG_REACH]
        return min(ends[0], end) if ends else reaches

    def _list_phases(
        self, leaves: float, reaches: float, closed: float
    ) -> tuple[tuple[PhaseName, Span], ...]:
        """Phases in order, each with a length; `closed` [s] ends the last one."""
        slip = self._compute_slip(leaves - _FLAG_REACH, closed)
        if slip is None or not slip.is_open.any():
            listed = [(PhaseName.BETWEEN_GEARS, (leaves, reaches))]
            listed.append((PhaseName.ENGAGED, (reaches, closed)))
        else:
            # A slip that swings through zero is that of an open clutch.
            time, count = slip.time, int(np.searchsorted(slip.time, leaves, side="right"))
            shut = [
                stop
                for first, stop in find_true_runs(~slip.is_open[:count])
                if time[stop - 1] - time[first] >= SETTINGS.max_dropout
            ]
            first_open = shut[-1] if shut else 0
            opened = slip.is_open[first_open:count].any()
            opens = float(time[first_open]) if opened else leaves
            closes = self._find_closing(reaches, closed)
            listed = [
                (PhaseName.CLUTCH_OPENS, (opens, leaves)),
                (PhaseName.NEUTRAL, (leaves, reaches)),
                (PhaseName.SYNCHRONISED, (reaches, closes)),
                (PhaseName.CLUTCH_CLOSES, (closes, closed)),
            ]
        kept = [(name, span) for name, span in listed if span[1] > span[0]]
        return tuple(kept or [(listed[0][0], (leaves, max(closed, leaves)))])

    def _find_closing(self, reaches: float, closed: float) -> float:
        """Corner [s] of two straight lines through the slip between engaged gear and lock-up."""
        slip = self._compute_slip(reaches, closed)
        if slip is None or slip.time.size < 6:
            return reaches
        time, costs = slip.time, []
        for corner in time[1:-2]:
            columns = np.column_stack(
                [np.ones_like(time), time - corner, np.maximum(time - corner, 0.0)]
            )
            left = slip.values - columns @ np.linalg.lstsq(columns, slip.values, rcond=None)[0]
            costs.append(float(left @ left))
        return float(time[1 + int(np.argmin(costs))])


def estimate_ratios(logs: Sequence[BusLog]) -> dict[str, float]:
    """Ratios of the gears that the logs hold, by the name on the bus, else by the ratio itself.

    Of ratios nearer than two gears can be, the one that is held longest counts.
    """
    parts = [(log, sample_speeds(log, one, 0.0)) for log in logs for one in log.stretches]
    parts = [(log, speeds) for log, speeds in parts if speeds.time.size >= _MIN_SAMPLES]
    held = merge_equal_ratios(one for _, speeds in parts for one in find_held_ratios(speeds))
    ratios: list[float] = []
    for one in sorted(held, key=lambda each: -each.time):
        if all(abs(np.log(one.ratio / other)) > _CLUSTER for other in ratios):
            ratios.append(one.ratio)
    found: dict[str, float] = {}
    for ratio in sorted(ratios, reverse=True):
        name = _find_name(parts, ratio)
        found[name if name and name not in found else f"i={ratio:.3f}"] = ratio
    return found


def _find_name(parts: Sequence[tuple[BusLog, GearboxSpeeds]], ratio: float) -> str:
    """Find the gear that the bus names most often while a ratio is held; empty without any."""
    names: Counter[str] = Counter()
    for log, speeds in parts:
        near = np.abs(speeds.compute_sync_error(ratio)) < SETTINGS.ratio_tolerance * speeds.input
        moving = speeds.output > SETTINGS.min_output_speed
        names.update(log.get_gear_value(float(one)) for one in speeds.time[near & moving])
    return max(names, key=lambda one: names[one], default="")
