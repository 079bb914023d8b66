# SPDX-License-Identifier: MIT
"""Survey of the contents of a log file, column by column, and the mapping drafted from it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from drivetwin._util.arrays import remember_for_arrays
from drivetwin.channels.filling import Filling, Interpolation
from drivetwin.channels.mapping import Mapped, combine_specs, make_spec, select_free
from drivetwin.channels.mapping_file import Candidate, Draft, Stub, UnitGap
from drivetwin.channels.recognition import find_hints, infer_candidates
from drivetwin.channels.roles import (
    FOR_CONTROL,
    NEEDED,
    ROLES,
    ChannelSpec,
    Quantity,
    ReadOptions,
    get_command_element,
    get_quantity,
    make_pressure_role,
)
from drivetwin.channels.roles import Column as LogColumn
from drivetwin.channels.shiftlog import FloatArray
from drivetwin.channels.units import (
    find_unit,
    is_ambiguous,
    is_unit,
    propose_missing_units,
    propose_time_units,
    propose_units,
    resolve_channel_unit,
)
from drivetwin.errors import DamagedChannelError, UnitError, Where
from drivetwin.logs.raw import RawChannel, Recording
from drivetwin.vehicle.card import VehicleCard

_MOST_CANDIDATES = 8
"""Candidates that are listed for a role [count]."""

_MOST_STATE = 20.0
"""Largest number of a gear or flag."""

_NO_CARD = (
    "Pressures are recognised by the elements of a vehicle card: give --vehicle. Without one, add "
    "an entry [channels.pressure.NAME] for the pressure of each element."
)
_TIME_UNKNOWN = "the log names no unit for its time column; state it"


def draft_mapping(
    survey: Survey, *, unnamed_step: float | None = None, accept: bool = False
) -> Draft:
    """Collect what the mapping of a survey leaves open.

    Parameters
    ----------
    survey : Survey
        Columns of the log and the mapping that would be used.
    unnamed_step : float or None
        Time between samples in the numbers of a log that names no unit of time, else None.
    accept : bool
        True if a unit that is the only proposal is to be an entry.
    """
    time = None
    if unnamed_step is not None:
        time = UnitGap(_TIME_UNKNOWN, propose_time_units(unnamed_step))
    return Draft(
        units=_list_unit_gaps(survey),
        stubs=_list_stubs(survey),
        time=time,
        remarks=(_NO_CARD,) if survey.elements is None else (),
        accept=accept,
    )


def draft_unread(
    elements: tuple[str, ...] | None,
    mapped: Collection[str],
    why: str,
    databases: Sequence[str] = (),
) -> Draft:
    """Return the draft for a log whose columns cannot be read, for the reason `why`.

    Roles that are `mapped` have no stub. `databases` are DBC files that may decode the log.
    """
    roles = [one for one in _list_roles(elements) if one not in mapped]
    remarks = (f"The log cannot be read: {why}", *(() if elements is not None else (_NO_CARD,)))
    stubs = tuple(Stub(one, _describe_role(one)) for one in roles)
    return Draft(stubs=stubs, time_source=True, remarks=remarks, databases=tuple(databases))


def _list_roles(elements: tuple[str, ...] | None) -> list[str]:
    """All roles: the needed ones first."""
    pressures = map(make_pressure_role, elements or ())
    return list(dict.fromkeys((*NEEDED, *pressures, *ROLES)))


def _describe_role(role: str) -> str:
    quantity = get_quantity(role)
    optional = "" if role in NEEDED or quantity is Quantity.PRESSURE else ", optional"
    return f"No column was found for {role} ({quantity}{optional})."


def _list_unit_gaps(survey: Survey) -> dict[str, UnitGap]:
    """Return the roles of the mapping whose unit the log does not name, or names unclearly."""
    faults: dict[str, tuple[str, bool]] = {}
    spans: dict[str, tuple[float, float] | None] = {}
    for role, spec in survey.mapping.items():
        column = _find_column(survey, spec)
        if column is None or spec.unit is not None:
            continue
        try:
            resolve_channel_unit(column.unit, get_quantity(role), Where())
        except UnitError as fault:
            unclear = is_ambiguous(column.unit)
            known = not unclear and is_unit(column.unit or "")
            faults[role] = fault.what, not unclear
            spans[role] = None if known else column.range
    proposals = propose_missing_units(spans)
    return {role: UnitGap(why, proposals[role], odd) for role, (why, odd) in faults.items()}


def _find_column(survey: Survey, spec: ChannelSpec) -> Column | None:
    for one in survey.columns:
        if spec.matches(LogColumn(one.name, one.unit, one.group)):
            return one
    return None


def _list_stubs(survey: Survey) -> tuple[Stub, ...]:
    """Return the roles without a column; roles with several candidates list them all."""
    taken = [_find_column(survey, spec) for spec in survey.mapping.values()]
    free = [one for one in survey.columns if one not in taken]
    stubs = []
    for role in _list_roles(survey.elements):
        if role in survey.mapping:
            continue
        rivals = [one for one in survey.columns if role in one.roles]
        why = f"{role} has several candidates: choose one." if rivals else ""
        found = rivals or [one for one in free if not (one.roles or one.ignored)]
        listed = [_make_candidate(one, role, survey, named=bool(rivals)) for one in found]
        candidates = sorted((one for one in listed if one is not None), key=_rank_candidate)
        stubs.append(Stub(role, why or _describe_role(role), tuple(candidates[:_MOST_CANDIDATES])))
    return tuple(stubs)


def _make_spec(column: Column, survey: Survey) -> ChannelSpec:
    alike = sum(other.name == column.name for other in survey.columns)
    return ChannelSpec(column.name, group=column.group if alike > 1 else None)


def _make_candidate(column: Column, role: str, survey: Survey, *, named: bool) -> Candidate | None:
    """Return a column as candidate of a role; None if neither name, unit nor values suggest it."""
    unit, quantity = (column.unit or "").strip(), get_quantity(role)
    span = "no numbers" if column.range is None else "{:.4g} to {:.4g}".format(*column.range)
    text, spec = f"{span} {unit}".strip(), _make_spec(column, survey)
    units = () if unit else propose_units(role, column.range)
    hints = find_hints([LogColumn(column.name)], role)
    if hints:
        return Candidate(spec, f"{text}; {hints[column.name]}")
    if named:
        return Candidate(spec, text, units)
    if unit:
        known = find_unit(unit)
        fits = known is not None and known.quantity is quantity
        return Candidate(spec, text) if fits and quantity is not Quantity.STATE else None
    if quantity is Quantity.STATE:
        return Candidate(spec, text) if _can_be_state(column) else None
    return Candidate(spec, text, units) if units else None


def _rank_candidate(candidate: Candidate) -> int:
    """Return the rank of the best unit; the unit that a log names is the best."""
    return 1 + candidate.units[0].rank if candidate.units else 0


def _can_be_state(column: Column) -> bool:
    """Return True if the limits of the values are small whole numbers, as of gears and flags."""
    if column.range is None:
        return False
    low, high = column.range
    whole = low == round(low) and high == round(high)
    return whole and -_MOST_STATE <= low < high <= _MOST_STATE


@dataclass(frozen=True)
class Column:
    """One column as recorded: `rate` [Hz] of its updates, `range` in the file's unit.

    `gaps` counts missing numbers and interruptions in time; `roles` are what it is, or might be.
    A column that is `ignored` gets no role by its name.
    """

    name: str
    group: str
    unit: str | None
    rate: float | None
    range: tuple[float, float] | None
    gaps: int
    roles: tuple[str, ...]
    ignored: bool = False

    def to_document(self) -> dict[str, Any]:
        """For JSON and tables."""
        return dict(vars(self))


@dataclass(frozen=True)
class Survey:
    """All columns of a file, the mapping that would be used, and what is missing for it."""

    source: str
    columns: tuple[Column, ...]
    mapping: Mapping[str, ChannelSpec]
    options: ReadOptions
    notes: tuple[str, ...]
    elements: tuple[str, ...] | None = None
    """Shift elements of the card; None without a card."""
    names: Mapping[str, Sequence[str]] = field(default_factory=dict)
    """Names of the user by role."""

    def to_document(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "source": self.source,
            "columns": [column.to_document() for column in self.columns],
            "mapping": {role: asdict(spec) for role, spec in self.mapping.items()},
            "notes": self.notes,
        }


def survey_recording(
    recording: Recording, source: str, card: VehicleCard | None, stated: Mapped
) -> Survey:
    """Look at an open log; the card names the pressures, what is `stated` overrides guesses.

    Raises the typed errors of the readers, but none for channels that are missing or ambiguous:
    these become notes.
    """
    columns = list(recording.columns)
    ignored = stated.options.ignored
    specs = combine_specs({} if card is None else card.channels, stated.channels, ignored)
    kinds = {} if card is None else {name: spec.kind for name, spec in card.elements.items()}
    free = select_free(columns, specs.values(), ignored)
    candidates = {
        **infer_candidates(free, kinds, stated.names),
        **{role: [one for one in columns if spec.matches(one)] for role, spec in specs.items()},
    }
    mapping = {
        role: specs.get(role) or make_spec(found[0], columns)
        for role, found in candidates.items()
        if len(found) == 1
    }
    looked: list[Column] = []
    faults: list[str] = []
    filled: list[str] = []
    mapped = [found[0] for found in candidates.values() if len(found) == 1]
    for index, column in enumerate(columns):
        roles = tuple(role for role, found in candidates.items() if column in found)
        try:
            channel = recording.load(index)
            computed = any(get_command_element(role) is not None for role in roles)
            filling = None if computed or not _is_rising(channel.time) else channel.filling
            is_ignored = column.name in ignored and not roles
            looked.append(_make_column(column, channel, filling, roles, ignored=is_ignored))
            if filling is not None and column not in mapped:
                filled.append(_describe_filling(column, filling))
        except DamagedChannelError as fault:
            faults.append(f"{column}: {fault.what}")
    return Survey(
        source=source,
        columns=tuple(looked),
        mapping=mapping,
        options=stated.options,
        elements=None if card is None else tuple(card.elements),
        names=stated.names,
        notes=(*recording.warnings, *faults, *filled, *_describe_open_roles(candidates, card)),
    )


def find_shortest_step(recording: Recording) -> float:
    """Return the shortest time between samples of any column; 0 without samples."""
    steps = []
    for index in range(len(recording.columns)):
        with suppress(DamagedChannelError):
            steps.append(recording.load(index).step)
    return min((step for step in steps if step is not None and step > 0.0), default=0.0)


def _make_column(
    column: LogColumn,
    channel: RawChannel,
    filling: Filling | None,
    roles: tuple[str, ...],
    *,
    ignored: bool,
) -> Column:
    if filling is None:
        rate = _estimate_update_rate(channel)
    else:
        rate = None if filling.interpolation is Interpolation.UNKNOWN else 1.0 / filling.period
    return Column(
        name=column.name,
        group=column.group,
        unit=column.unit,
        rate=rate,
        range=channel.range,
        gaps=int(np.count_nonzero(~np.isfinite(channel.values))) + channel.pauses,
        roles=roles,
        ignored=ignored,
    )


def _describe_filling(column: LogColumn, filling: Filling) -> str:
    if filling.interpolation is Interpolation.UNKNOWN:
        return f"{column}: filled up by interpolation; the measured samples cannot be found"
    return (
        f"{column}: filled up by {filling.interpolation} interpolation from "
        f"{1e3 * filling.period:.4g} ms to {1e3 * filling.step:.4g} ms; only the measured samples "
        "are used"
    )


def _estimate_update_rate(channel: RawChannel) -> float | None:
    """Return the updates per second; for a held signal the rate of the sender."""
    step = channel.step
    if step is None or step <= 0.0:
        return None
    raster = channel.raster if _is_rising(channel.time) else None
    return 1.0 / (step if raster is None else raster.period)


@remember_for_arrays
def _is_rising(time: FloatArray) -> bool:
    return bool(np.isfinite(time).all() and np.all(time[1:] > time[:-1]))


def _describe_open_roles(
    candidates: Mapping[str, Sequence[LogColumn]], card: VehicleCard | None
) -> list[str]:
    """Roles that no column, or more than one, could play."""
    notes = [
        f"{role} has candidates: {', '.join(map(str, found))}: name one in a channel mapping"
        for role, found in candidates.items()
        if len(found) > 1
    ]
    of_control = any(get_command_element(role) is not None for role in candidates)
    wanted = [
        *(NEEDED if card or not of_control else FOR_CONTROL),
        *(make_pressure_role(element) for element in (card.elements if card else ())),
    ]
    missing = [role for role in wanted if not candidates.get(role)]
    if missing:
        notes.append(f"no column for {', '.join(missing)}: name it in a channel mapping")
    if card is None and not of_control:
        notes.append(
            "pressures are recognised by the elements of a vehicle card: give --vehicle CARD; "
            "'drivetwin card new -o CARD.toml --from LOG' writes one"
        )
    return notes
