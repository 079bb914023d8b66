# SPDX-License-Identifier: MIT
"""Draft of a channel mapping from the survey of a log: what was found, and what is open."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from drivetwin.channels.mapping_text import Candidate, Draft, Stub, UnitGap
from drivetwin.channels.read_options import ChannelSpec
from drivetwin.channels.read_options import Column as LogColumn
from drivetwin.channels.recognition import find_hints
from drivetwin.channels.roles import NEEDED, ROLES, Quantity, get_quantity, make_pressure_role
from drivetwin.channels.units import (
    find_unit,
    propose_missing_units,
    propose_time_units,
    propose_units,
    resolve_channel_unit,
)
from drivetwin.errors import UnitError, Where
from drivetwin.logs.survey import Column, Survey

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
    reasons: dict[str, str] = {}
    spans: dict[str, tuple[float, float] | None] = {}
    for role, spec in survey.mapping.items():
        column = _find_column(survey, spec)
        if column is None or spec.unit is not None:
            continue
        try:
            resolve_channel_unit(column.unit, get_quantity(role), Where())
        except UnitError as fault:
            reasons[role], spans[role] = fault.what, column.range
    proposals = propose_missing_units(spans)
    return {role: UnitGap(why, proposals[role]) for role, why in reasons.items()}


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
