# SPDX-License-Identifier: MIT
"""Forms of a session: the channel mapping by column, and the questions of a new card."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from drivetwin.authoring.card_text import format_card, refuse_faults
from drivetwin.authoring.log_estimates import LogEstimates
from drivetwin.authoring.log_survey import LogSurvey
from drivetwin.authoring.question import FormEntry, Key
from drivetwin.authoring.questions import Sources
from drivetwin.authoring.session import Session
from drivetwin.channels.mapping import make_spec
from drivetwin.channels.roles import (
    EXTRA_ROLES,
    ROLES,
    ChannelSpec,
    Quantity,
    get_quantity,
    is_extra,
    make_command_role,
    make_pressure_role,
)
from drivetwin.channels.roles import Column as LogColumn
from drivetwin.channels.units import (
    is_time_unit,
    list_first_spellings,
    list_time_spellings,
    resolve_channel_unit,
)
from drivetwin.errors import InputError, MappingError, UnitError, Where
from drivetwin.logs.survey import Column, Survey, draft_mapping


@dataclass(frozen=True)
class Row:
    """A column as recorded and what it is taken for; an empty `role`: not used.

    A unit that is `proposed` follows from the values, because neither file nor mapping names one.
    """

    column: Column
    role: str
    unit: str
    reversed: bool
    proposed: bool = False


@dataclass(frozen=True)
class Entry:
    """User input for one column, in the order of the rows."""

    role: str
    unit: str
    reversed: bool


@dataclass(frozen=True)
class Corrections:
    """Corrections of a log's mapping: specs by role, and columns that get none by their name.

    `time_unit` is the unit of the time column; None: as the file or its mapping states it.
    """

    channels: Mapping[str, ChannelSpec] = field(default_factory=dict)
    ignored: tuple[str, ...] = ()
    time_unit: str | None = None


def list_roles(survey: Survey) -> tuple[str, ...]:
    """List the roles that a column may have: those of shifts, pressures, extra ones."""
    elements = survey.elements or ()
    pressures = (*map(make_pressure_role, elements), *map(make_command_role, elements))
    found = [role for role in survey.mapping if is_extra(role)]
    return tuple(dict.fromkeys((*ROLES, *pressures, *EXTRA_ROLES, *found)))


def list_unit_names() -> list[str]:
    """The first spelling of each unit, for completion."""
    measured = (Quantity.TORQUE, Quantity.SPEED, Quantity.PRESSURE, Quantity.FRACTION)
    return [spelling for quantity in measured for spelling in list_first_spellings(quantity)]


def list_rows(survey: Survey) -> list[Row]:
    """The columns with the role, unit and sign that they are read with."""
    gaps = draft_mapping(survey).units
    likely = {role: unit for role, gap in gaps.items() if (unit := gap.only_unit) is not None}
    return [_make_row(column, survey, likely) for column in survey.columns]


def apply_entries(survey: Survey, entries: Sequence[Entry], time_unit: str = "") -> Corrections:
    """Return the mapping as the user states it; scale, offset and time shift stay.

    Raises MappingError where two columns have one role, UnitError for a unit that does not fit the
    role.
    """
    if len(entries) != len(survey.columns):
        raise MappingError(
            f"{len(entries)} rows for {len(survey.columns)} columns", "state a row for each column"
        )
    found: dict[str, ChannelSpec] = {}
    every = [LogColumn(one.name, one.unit, one.group) for one in survey.columns]
    for column, entry in zip(survey.columns, entries, strict=True):
        if not entry.role:
            continue
        if entry.role in found:
            raise MappingError(
                f"{found[entry.role].source!r} and {column.name!r} are both {entry.role}",
                "give the role to one of them",
            )
        present = survey.mapping.get(entry.role)
        spec = make_spec(LogColumn(column.name, column.unit, column.group), every)
        if present is not None and present.source == column.name:
            spec = replace(present, group=spec.group)
        found[entry.role] = replace(
            spec,
            unit=_parse_assertion(entry, column),
            sign=-1 if entry.reversed else 1,
        )
    return Corrections(found, _list_ignored(survey, found), _parse_time_unit(time_unit))


def _make_row(column: Column, survey: Survey, likely: Mapping[str, str]) -> Row:
    role, spec = _make_spec(column, survey.mapping)
    unit = spec.unit if spec is not None and spec.unit is not None else column.unit
    proposed = not (unit or "").strip() and role in likely
    if proposed:
        unit = likely[role]
    return Row(column, role, unit or "", spec is not None and spec.sign < 0, proposed)


def _make_spec(
    column: Column, mapping: Mapping[str, ChannelSpec]
) -> tuple[str, ChannelSpec | None]:
    for role, spec in mapping.items():
        if spec.source == column.name and spec.group in (None, column.group):
            return role, spec
    return "", None


def _parse_assertion(entry: Entry, column: Column) -> str | None:
    """Return the unit if it differs from the file's unit; check it against the role."""
    unit = entry.unit.strip()
    if unit == (column.unit or ""):
        return None
    where = Where(channel=column.name)
    try:
        resolve_channel_unit(unit, get_quantity(entry.role), where)
    except UnitError as error:
        usual = ", ".join(list_first_spellings(get_quantity(entry.role)))
        raise UnitError(error.what, f"use one of {usual}", where) from None
    return unit


def _parse_time_unit(text: str) -> str | None:
    """Return a unit of time that is known; None for a blank text."""
    unit = text.strip()
    if unit and not is_time_unit(unit):
        listed = ", ".join(list_time_spellings())
        raise UnitError(f"unknown time unit {unit!r}", f"use one of {listed}")
    return unit or None


def _list_ignored(survey: Survey, found: Mapping[str, ChannelSpec]) -> tuple[str, ...]:
    """List the columns without a role that would get one by their name."""
    used = {spec.source for spec in found.values()}
    recognised = (one.name for one in survey.columns if one.roles or one.ignored)
    return tuple(dict.fromkeys(name for name in recognised if name not in used))


@dataclass(eq=False)
class CardForm:
    """Fields of a form: the texts typed so far, and the questions that follow from them.

    `file_name` is the name under which the card is written.
    """

    survey: LogSurvey
    file_name: str = "vehicle.toml"
    texts: Mapping[Key, str] = field(default_factory=dict)
    entries: list[FormEntry] = field(default_factory=list)
    _estimates: dict[object, LogEstimates] = field(default_factory=dict)

    def fill_in(self, texts: Mapping[Key, str]) -> None:
        """Take the texts of some fields, and ask the questions that follow."""
        self.texts = {**self.texts, **texts}
        self.entries = self._begin().fill_form(self.texts)

    def format_card(self, file: str) -> str:
        """Return the text of the card.

        Raises InputError while answers are missing or refused, CardError where the answers
        contradict each other.
        """
        session = self._begin()
        open_ = [one for one in session.fill_form(self.texts) if one.fault]
        if open_:
            listed = "".join(f"\n  - {one.question.prompt}: {one.fault}" for one in open_)
            count = "1 answer is" if len(open_) == 1 else f"{len(open_)} answers are"
            raise InputError(f"{count} missing or refused:{listed}", "complete these fields")
        text = format_card(session.answers, self.survey, session.estimates)
        refuse_faults(text, file)
        return text

    def _begin(self) -> Session:
        return Session({}, Sources("vehicle", self.survey), self._estimates)
