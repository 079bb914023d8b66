# SPDX-License-Identifier: MIT
"""Editable channel mapping: one row for each column of the file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from drivetwin.channels.channel_spec import ChannelSpec
from drivetwin.channels.mapping import make_spec
from drivetwin.channels.pressure_roles import make_pressure_role
from drivetwin.channels.read_options import Column as LogColumn
from drivetwin.channels.roles import ROLES, get_quantity
from drivetwin.channels.shiftlog import Quantity
from drivetwin.channels.units import list_first_spellings, resolve_channel_unit
from drivetwin.errors import MappingError, UnitError, Where
from drivetwin.logs.survey import Column, Survey


@dataclass(frozen=True)
class Row:
    """A column as recorded and what it is taken for; an empty `role`: not used."""

    column: Column
    role: str
    unit: str
    reversed: bool


@dataclass(frozen=True)
class Entry:
    """User input for one column, in the order of the rows."""

    role: str
    unit: str
    reversed: bool


def list_roles(survey: Survey) -> tuple[str, ...]:
    """List the roles that a column may have, the pressures of the elements last."""
    return (*ROLES, *(make_pressure_role(element) for element in survey.elements or ()))


def list_unit_names() -> list[str]:
    """The first spelling of each unit, for completion."""
    measured = (Quantity.TORQUE, Quantity.SPEED, Quantity.PRESSURE, Quantity.FRACTION)
    return [spelling for quantity in measured for spelling in list_first_spellings(quantity)]


def list_rows(survey: Survey) -> list[Row]:
    """The columns with the role, unit and sign that they are read with."""
    return [_make_row(column, survey) for column in survey.columns]


def apply_entries(survey: Survey, entries: Sequence[Entry]) -> dict[str, ChannelSpec]:
    """Channel specs by role as the user states them; scale, offset and time shift stay.

    Raises MappingError where two columns have one role or a column that is recognised by its name
    is set aside while no other takes its role, UnitError for a unit that does not fit the role.
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
    _refuse_set_aside(survey, found)
    return found


def _make_row(column: Column, survey: Survey) -> Row:
    role, spec = _make_spec(column, survey.mapping)
    unit = spec.unit if spec is not None and spec.unit is not None else column.unit
    return Row(column, role, unit or "", spec is not None and spec.sign < 0)


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


def _refuse_set_aside(survey: Survey, found: Mapping[str, ChannelSpec]) -> None:
    """Raise if a column is set aside although the reader would recognise its role by its name."""
    for role, spec in survey.mapping.items():
        used = any(one.source == spec.source for one in found.values())
        if role not in found and not used:
            raise MappingError(
                f"column {spec.source!r} is recognised as {role} by its name",
                "give that role to another column, or rename the column in the file",
            )
