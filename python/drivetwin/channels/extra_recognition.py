# SPDX-License-Identifier: MIT
"""Recognition of channels of extra roles, among the columns that no other role claims."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache

from drivetwin.channels.extra_roles import EXTRA_ROLES, get_extra_quantity, is_extra
from drivetwin.channels.name_table import load_name_table
from drivetwin.channels.read_options import Column
from drivetwin.channels.shiftlog import Quantity
from drivetwin.channels.units import find_unit

Spelled = Sequence[tuple[Column, str]]
"""Columns with their names in the form of `normalise_name`."""

_ENGINES = {"motor_torque": "engine_torque", "motor_speed": "engine_speed"}
"""Roles of the engine whose names, such as `MotTrq`, may be those of the electric motor."""


def add_extra_candidates(
    found: Mapping[str, list[Column]], wholes: Spelled, own: Mapping[str, Iterable[str]]
) -> dict[str, list[Column]]:
    """Return the candidates by role with those of the extra roles.

    Parameters
    ----------
    found
        Candidates of the other roles.
    wholes
        All columns.
    own
        Names of the user by role, in the form of `normalise_name`.
    """
    extra = find_extra(wholes)
    for role, names in own.items():
        if is_extra(role):
            stated = [column for column, text in wholes if text in names]
            extra[role] = stated or extra.get(role, [])
    kept = {role: _drop_motors(role, some, extra) for role, some in found.items()}
    taken = [column for some in kept.values() for column in some]
    for role, some in extra.items():
        left = [one for one in some if one not in taken]
        filled = [one for one in left if not one.empty] or left
        if filled:
            kept[role] = filled
    return kept


def _drop_motors(
    role: str, candidates: list[Column], extra: Mapping[str, list[Column]]
) -> list[Column]:
    """Return the candidates of an engine role without those of the electric motor.

    `MotTrq` is that of the engine, unless another column such as `EngTrq` names the engine.
    """
    motor = next((one for one, engine in _ENGINES.items() if engine == role), None)
    if motor is None or len(candidates) < 2:
        return candidates
    engines = [one for one in candidates if one not in extra.get(motor, [])]
    named = [one for one in engines if "mot" not in one.name.casefold()]
    return engines if named else candidates


def find_extra(wholes: Spelled) -> dict[str, list[Column]]:
    """Find the columns of each extra role by name and unit."""
    found: dict[str, list[Column]] = {}
    for column, text in wholes:
        for role in _list_roles(text, has_unit_of(column, Quantity.TEMPERATURE, stated=True)):
            quantity = get_extra_quantity(role)
            if quantity is not None and has_unit_of(column, quantity):
                found.setdefault(role, []).append(column)
    return found


def has_unit_of(column: Column, quantity: Quantity, *, stated: bool = False) -> bool:
    """Return True for a unit of the quantity; without a unit True unless it must be `stated`."""
    text = (column.unit or "").strip()
    if not text or quantity is Quantity.STATE:
        return not stated
    unit = find_unit(text)
    return unit is not None and unit.quantity is quantity


def _list_roles(text: str, is_temperature: bool) -> list[str]:
    """List the extra roles of a name."""
    table = load_name_table()
    roles = [role for role in EXTRA_ROLES if re.fullmatch(_surround(table.patterns[role]), text)]
    for form in _get_shaft_forms():
        if match := re.fullmatch(form, text):
            place = "".join(one or "" for one in match.groups())
            return [*roles, f"shaft_torque.{re.sub('^shaft(?=.)', '', place)}"]
    for form in _get_temperature_forms(any_place=is_temperature):
        if match := re.fullmatch(form, text):
            return [*roles, f"temperature.{match['place']}"]
    return roles


def _surround(pattern: str) -> str:
    """Return an expression with words that may precede and follow."""
    table = load_name_table()
    before, after = table.make_alternatives("before"), table.make_alternatives("after")
    return f"(?:{before})*(?:{pattern})(?:{after})*"


@cache
def _get_shaft_forms() -> tuple[str, ...]:
    """Return expressions of torques of shafts: torque first, shaft first; groups are the place."""
    table = load_name_table()
    torque, shaft = _list_longest_first("plain_torque"), _list_longest_first("shaft")
    state = f"(?:{table.make_alternatives('state')})*"
    words = f"{torque}|m|md|mom|moment|drehmoment"
    rest = f"(?:{table.make_alternatives('side')}|[a-z0-9]{{0,2}}?)"
    return (
        f"(?:{words})((?:{shaft}){rest}){state}",
        f"((?:{shaft})[a-z0-9]*?)(?:{torque}|moment|drehmoment){state}([a-z0-9]*)",
    )


@cache
def _get_temperature_forms(*, any_place: bool) -> tuple[str, ...]:
    """Return expressions of temperatures: word first, place first.

    A place of any name needs a unit of temperature.
    """
    table = load_name_table()
    words, places = _list_longest_first("temperature"), _list_longest_first("place")
    state = f"(?:{table.make_alternatives('state')})*"
    listed = f"(?P<place>(?:{places})+[0-9]*)"
    forms = [f"(?:{words}|t){listed}{state}", f"{listed}(?:{words}|t){state}"]
    if any_place:
        free = "(?P<place>[a-z][a-z0-9]*?)"
        forms += [f"(?:{words}){free}{state}", f"{free}(?:{words}){state}"]
    return tuple(forms)


def _list_longest_first(kind: str) -> str:
    """Return the expression of the words of a kind, so that none is cut short by its beginning."""
    return "|".join(sorted(load_name_table().words[kind], key=len, reverse=True))
