# SPDX-License-Identifier: MIT
"""Shifts of the log of a gearbox control: rows about each change of the commanded gear."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations
from pathlib import Path

import numpy as np
from scipy.constants import zero_Celsius

from drivetwin._util.arrays import FloatArray
from drivetwin.channels.mapping import Mapped, make_spec
from drivetwin.channels.mapping_file import read_mapping, read_project_mapping
from drivetwin.channels.recognition import find_candidates
from drivetwin.channels.roles import (
    FOR_CONTROL,
    ChannelSpec,
    Column,
    Quantity,
    get_quantity,
    make_command_role,
)
from drivetwin.channels.units import resolve_channel_unit
from drivetwin.errors import MappingError, MissingChannelError, NoShiftError, Where
from drivetwin.logs.formats.detect import open_recording
from drivetwin.logs.quality.channel_checks import check_magnitude, check_order
from drivetwin.logs.quality.outliers import find_dropouts, find_spikes
from drivetwin.logs.raw import Recording
from drivetwin.tcu.card import ControllerCard

SPEEDS = ("engine_speed", "input_speed", "output_speed")
"""Roles of the compared speeds: engine, turbine, output."""
_TARGET, _OIL = "requested_gear", "temperature.oil"
_GAP = 0.5
"""Time between two rows from which they belong to different recordings [s]."""
_BEFORE, _AFTER = 2.0, 3.0
"""Longest time before a change of the commanded gear, and after it, that is used [s]."""
_LEAST_BEFORE, _LEAST_AFTER = 0.4, 1.0
"""Shortest time before and after that a shift needs [s]."""


@dataclass(frozen=True, eq=False)
class ControllerShift:
    """Rows of one shift; times [s] from its first row, SI, pressures in Pa.

    `speeds` (n, 3) of engine, turbine and output. `off` releases and `on` applies, with their
    `commands` (n,) by element; `lockup` is None where the clutch stays open. `change` is the
    time of the commanded gear, `begin` that of the first row [s]. `oil` in °C.
    """

    number: int
    gears: tuple[str, str]
    off: str
    on: str
    begin: float
    time: FloatArray
    speeds: FloatArray
    torque: FloatArray
    commands: dict[str, FloatArray]
    lockup: FloatArray | None
    change: float
    oil: float

    @property
    def kind(self) -> str:
        """Gears before and after."""
        return f"{self.gears[0]}-{self.gears[1]}"

    @property
    def name(self) -> str:
        """Number and gears."""
        return f"shift {self.number}, {self.kind}"


@dataclass(frozen=True, eq=False)
class ControllerLog:
    """Shifts of a log, and those left out with the reason."""

    source: str
    shifts: tuple[ControllerShift, ...]
    left_out: tuple[str, ...]


def read_controller_log(
    path: Path, card: ControllerCard, mapping: Path | Mapped | None = None
) -> ControllerLog:
    """Read the shifts of a log.

    Columns are recognised by their names or those of a channel mapping: speeds, engine torque,
    commanded gear, commanded pressures of the elements of the card.

    Raises
    ------
    MissingChannelError, MappingError
        Where a needed column is missing or not unique.
    PlausibilityError
        Where a column is in another unit.
    NoShiftError
        Where no shift has the rows that a fit needs, with the reasons.
    """
    if isinstance(mapping, Mapped):
        stated = mapping
    else:
        stated = read_project_mapping(path) if mapping is None else read_mapping(mapping)
    with open_recording(path, stated.options) as recording:
        specs = _find_columns(path, card, dict(stated.channels), recording.columns)
        raw = {role: _load(recording, spec, role, path) for role, spec in specs.items()}
    time = raw["input_speed"][0]
    check_order(time, Where(file=str(path), channel=specs["input_speed"].source))
    held = {}
    for role, (stamps, values) in raw.items():
        at = np.clip(np.searchsorted(stamps, time, side="right") - 1, 0, None)
        held[role] = values[at]
    log = _cut_shifts(str(path), card, time, held)
    _require_ratios(
        card, log.shifts, [specs[role].source for role in SPEEDS], Where(file=str(path))
    )
    return log


def _load(
    recording: Recording, spec: ChannelSpec, role: str, path: Path
) -> tuple[FloatArray, FloatArray]:
    """Load stamps (n,) [s] and values (n,) [SI] of a column as the control wrote them.

    A control writes what it computed with, so that no sample is looked for filling. Speeds that
    spike or fall to zero are no numbers.
    """
    picked = [k for k, column in enumerate(recording.columns) if spec.matches(column)]
    where = Where(file=str(path), channel=spec.source)
    if not picked:
        what = f"the log has no column {spec.source!r}"
        raise MissingChannelError(what, "correct its name in the channel mapping", where)
    raw = recording.load(picked[0])
    unit = resolve_channel_unit(spec.unit or raw.unit, get_quantity(role), where, role)
    values = unit.to_si(spec.sign * (spec.scale * raw.values + spec.offset))
    time = raw.time + spec.time_shift
    if role in SPEEDS:
        for damage in find_dropouts(time, values), find_spikes(time, values, Quantity.SPEED):
            values = values if damage is None else np.where(damage.mask, np.nan, values)
    quantity, known = get_quantity(role), np.isfinite(values)
    if known.any():
        check_magnitude(role, quantity, values[known], spec.unit or raw.unit or "", where)
    return time, np.asarray(values)


def _find_columns(
    path: Path, card: ControllerCard, stated: dict[str, ChannelSpec], columns: Sequence[Column]
) -> dict[str, ChannelSpec]:
    """Return the column of each role. Raises the typed errors of a missing or ambiguous one."""
    used = {name for levers in card.levers.values() for name in levers}
    commands = [make_command_role(name) for name in sorted(used)]
    needed = [*FOR_CONTROL, *commands]
    found = {}
    for role in [*needed, _OIL, make_command_role(card.lockup)]:
        if role in stated:
            found[role] = stated[role]
            continue
        fitting = find_candidates(columns, role)
        if len(fitting) == 1:
            found[role] = make_spec(fitting[0], columns)
        elif role in needed:
            where, remedy = Where(file=str(path)), f"name the column of {role!r} with --channels"
            if fitting:
                names = ", ".join(one.name for one in fitting)
                raise MappingError(f"{role!r} has several candidates: {names}", remedy, where)
            known = ", ".join(dict.fromkeys(one.name for one in columns))
            what = f"no column has a name of {role!r}; the log has {known}"
            raise MissingChannelError(what, remedy, where)
    return found


def _cut_shifts(
    source: str,
    card: ControllerCard,
    time: FloatArray,
    held: dict[str, FloatArray],
) -> ControllerLog:
    """Cut the rows about each change of the commanded gear. Raises NoShiftError without any."""
    names = {_parse_gear(name): name for name in card.ratios}
    target = held[_TARGET]
    ends = np.flatnonzero(np.diff(time) > _GAP) + 1
    shifts: list[ControllerShift] = []
    left_out: list[str] = []
    for part in np.split(np.arange(time.size), ends):
        changes = part[1:][np.diff(target[part]) != 0.0]
        for place, at in enumerate(changes):
            gears = tuple(names.get(float(target[k]), f"{target[k]:g}") for k in (at - 1, at))
            first = changes[place - 1] if place else part[0]
            last = changes[place + 1] - 1 if place + 1 < changes.size else part[-1]
            rows = np.arange(first, last + 1)
            near = (time[rows] >= time[at] - _BEFORE) & (time[rows] <= time[at] + _AFTER)
            rows = rows[near]
            fault = _find_fault(card, gears, time[rows], time[at], held, rows)
            if fault:
                left_out.append(f"{time[at]:.2f} s, {gears[0]}-{gears[1]}: {fault}")
                continue
            shifts.append(_make_shift(card, len(shifts) + 1, gears, time, rows, at, held))
    if not shifts:
        reasons = "; ".join(left_out) or "the commanded gear never changes"
        raise NoShiftError(
            f"no shift can be used: {reasons}",
            "record shifts with at least 0.4 s before and 1 s after the change of the commanded "
            "gear, and name their gears on the card under [[changes]]",
            Where(file=source),
        )
    return ControllerLog(source, tuple(shifts), tuple(left_out))


def _require_ratios(
    card: ControllerCard, shifts: Sequence[ControllerShift], columns: Sequence[str], where: Where
) -> None:
    """Raise MappingError where other `columns` of speeds than those of turbine and output have the
    ratios of the gears: two are swapped."""
    apart = {}
    for pair in permutations(range(len(SPEEDS)), 2):
        parts = []
        for one in shifts:
            first, second = one.speeds[one.time < one.change][:, pair].T
            with np.errstate(divide="ignore", invalid="ignore"):
                parts.append(np.median(np.abs(first / second / card.ratios[one.gears[0]] - 1.0)))
        apart[pair] = 100.0 * float(np.median(parts))
    best = min(apart, key=lambda pair: apart[pair])
    if apart[1, 2] < _SAME_RATIO or not apart[best] < _SAME_RATIO:
        return
    stated, fitting = (" over ".join(repr(columns[k]) for k in pair) for pair in ((1, 2), best))
    pairs = zip(SPEEDS, (len(SPEEDS) - sum(best), *best), strict=True)
    lines = [f'channels.{role} = {{ source = "{columns[k]}" }}' for role, k in pairs]
    raise MappingError(
        f"speeds are swapped: {stated} is off the ratios of the gears by {apart[1, 2]:.1f} %, "
        f"{fitting} by {apart[best]:.1f} %",
        f"name the columns in the channel mapping, {', '.join(lines)}",
        where,
    )


_SAME_RATIO = 1.0
"""Error of a ratio that unlike ages and windows of the speeds explain; a converter slips more
[%]."""


def _parse_gear(name: str) -> float:
    try:
        return float(name)
    except ValueError:
        return float("nan")


def _find_fault(
    card: ControllerCard,
    gears: tuple[str, ...],
    time: FloatArray,
    change: float,
    held: dict[str, FloatArray],
    rows: FloatArray,
) -> str:
    """Return the reason against a shift, empty where there is none."""
    levers = card.levers.get(frozenset(gears))
    if levers is None:
        return "the card has no [[changes]] for these gears"
    if change - time[0] < _LEAST_BEFORE or time[-1] - change < _LEAST_AFTER:
        return f"{change - time[0]:.2f} s before and {time[-1] - change:.2f} s after the change"
    needed = (*SPEEDS, "engine_torque", *map(make_command_role, (*levers, card.lockup)))
    missing = [one for one in needed if one in held and not np.isfinite(held[one][rows]).all()]
    if missing:
        return f"missing or damaged numbers of {', '.join(missing)}"
    still = [one for one in levers if np.ptp(held[make_command_role(one)][rows]) == 0.0]
    return f"the command of {' and of '.join(still)} does not change" if still else ""


def _make_shift(
    card: ControllerCard,
    number: int,
    gears: tuple[str, ...],
    time: FloatArray,
    rows: FloatArray,
    at: int,
    held: dict[str, FloatArray],
) -> ControllerShift:
    begin = float(time[rows[0]])
    first, second = (set(card.elements[name]) for name in gears)
    levers = card.levers[frozenset(gears)]
    lockup = held.get(make_command_role(card.lockup))
    is_used = lockup is not None and bool(np.max(lockup[rows]) > 0.0)
    oil = held[_OIL][rows] if _OIL in held else np.empty(0)
    oil = oil[np.isfinite(oil)]
    return ControllerShift(
        number=number,
        gears=(gears[0], gears[1]),
        off=(first - second).pop(),
        on=(second - first).pop(),
        begin=begin,
        time=time[rows] - begin,
        speeds=np.column_stack([held[role][rows] for role in SPEEDS]),
        torque=held["engine_torque"][rows],
        commands={name: held[make_command_role(name)][rows] for name in levers},
        lockup=lockup[rows] if is_used and lockup is not None else None,
        change=float(time[at]) - begin,
        oil=float(np.mean(oil)) - zero_Celsius if oil.size else REFERENCE_OIL,
    )


REFERENCE_OIL = 60.0
"""Oil temperature at which clutch numbers are stated [°C]; that of a log without one."""
