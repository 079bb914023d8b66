# SPDX-License-Identifier: MIT
"""Recognition of channels by their names, and of commanded pressures by their steps.

Extra roles are recognised among the columns that no other role claims.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence, Set
from functools import cache
from itertools import chain

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.channels.names import NameTable, load_name_table, normalise_name
from drivetwin.channels.roles import (
    EXTRA_ROLES,
    Column,
    Quantity,
    get_element,
    get_extra_quantity,
    get_pressure_element,
    get_quantity,
    is_extra,
    make_command_role,
    make_pressure_role,
)
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.channels.units import BAR, find_unit
from drivetwin.errors import MissingChannelError, Where
from drivetwin.findings import Code, Finding, report

WHOLE_WORD = 3
"""Fewest letters of a word that is no abbreviation."""


def infer_candidates(
    columns: Sequence[Column],
    elements: Mapping[str, str],
    names: Mapping[str, Sequence[str]] | None = None,
) -> dict[str, list[Column]]:
    """Return the candidate columns of each role; `elements` gives the kind of each by name.

    Columns of the user's `names` by role come before those of the built-in table.
    A column without any number, or from a strange sender, is a candidate only where no other is, a
    silent one never.
    """
    columns = [column for column in columns if not column.silent]
    table = load_name_table()
    patterns = {
        **{
            role: _list_patterns(pattern, table)
            for role, pattern in table.patterns.items()
            if not is_extra(role)
        },
        **{
            make_pressure_role(element): _list_pressure_patterns(element, kind, table)
            for element, kind in elements.items()
        },
        **{
            make_command_role(element): _list_command_patterns(element, kind, table)
            for element, kind in elements.items()
        },
    }
    own = {role: [*map(normalise_name, some)] for role, some in (names or {}).items()}
    words = _Vocabulary({*table.vocabulary, *_list_element_words(elements), *chain(*own.values())})
    wholes = [(column, normalise_name(column.name)) for column in columns]
    parts = [
        (column, normalise_name(re.split(r"[./]", column.name)[-1]))
        for column in columns
        if "." in column.name or "/" in column.name
    ]
    spelled = [
        [one for one in some if one[0].empty is empty and words.can_spell(one[1])]
        for empty in (False, True)
        for some in (wholes, parts)
    ]
    added = {role: "|".join(some) for role, some in own.items()}
    found = {
        role: _select_first_match(spelled, [one for one in (added.get(role), *some) if one])
        for role, some in patterns.items()
    }
    chosen = {
        role: ([column for column in some if not column.aside] or some)
        for role, some in found.items()
        if some
    }
    return add_extra_candidates(chosen, wholes, own)


def find_candidates(columns: Sequence[Column], role: str) -> list[Column]:
    """Return the columns whose name fits a role that is wanted, whatever other roles they fit.

    A pressure is that of a clutch or a brake. Raises KeyError for a role that does not exist.
    """
    quantity = get_quantity(role)
    columns = [one for one in columns if not one.silent and has_unit_of(one, quantity)]
    if is_extra(role):
        wholes = [(column, normalise_name(column.name)) for column in columns]
        return prefer_filled(find_extra(wholes).get(role, []))
    element = get_element(role)
    kinds = [{}] if element is None else [{element: "clutch"}, {element: "brake"}]
    for elements in kinds:
        if found := infer_candidates(columns, elements).get(role):
            return found
    return []


def find_hints(columns: Iterable[Column], role: str) -> dict[str, str]:
    """Return the columns, by name, that are related to a role, with the reason against their use.

    They are proposed to the user, never used.
    """
    hints = load_name_table().hints.get(role, {})
    found = ((column.name, hints.get(normalise_name(column.name))) for column in columns)
    return {name: why for name, why in found if why is not None}


def prefer_filled(candidates: list[Column]) -> list[Column]:
    """Return the columns that hold numbers; all if none does."""
    return [column for column in candidates if not column.empty] or candidates


def _select_first_match(
    spellings: Iterable[Sequence[tuple[Column, str]]], patterns: Iterable[str]
) -> list[Column]:
    """Return the columns that match the first pattern of `patterns` that matches any column.

    Each of the `spellings` counts only where those before match none: the last part of a name like
    `log.EngTrq` after whole names, columns without numbers after those with.
    """
    patterns = tuple(patterns)
    for texts in filter(None, spellings):
        for pattern in map(re.compile, patterns):
            if found := [column for column, text in texts if pattern.fullmatch(text)]:
                return found
    return []


class _Vocabulary:
    """Words that the names of all roles consist of; most columns of a large file have others."""

    def __init__(self, words: Set[str]) -> None:
        self._words = words
        self._lengths = sorted({len(word) for word in words if word})

    def can_spell(self, text: str) -> bool:
        """Return True if the text is a row of words."""
        reached, ends = 0, [0]
        while reached < len(ends):
            start = ends[reached]
            reached += 1
            if start == len(text):
                return True
            for length in self._lengths:
                end = start + length
                if end <= len(text) and end not in ends and text[start:end] in self._words:
                    ends.append(end)
        return False


def _list_element_words(elements: Iterable[str]) -> Iterator[str]:
    """List the words of elements in names of pressures: labels and numbers."""
    yield "0"
    for element in elements:
        label = normalise_name(element)
        yield from (label, re.sub(r"\D", "", label))


def _list_patterns(pattern: str, table: NameTable) -> list[str]:
    """List the expressions of a role's names: plain, then with words before and after."""
    before, after = table.make_alternatives("before"), table.make_alternatives("after")
    return [pattern, f"({before})*({pattern})({after})*"]


def _list_pressure_patterns(element: str, kind: str, table: NameTable) -> list[str]:
    """List the expressions of a pressure: full name or kind and number first, number last."""
    label = re.escape(normalise_name(element))
    digits = re.sub(r"\D", "", label)
    pressure, words = table.make_alternatives("pressure"), table.make_alternatives(kind)
    state = f"({table.make_alternatives('state')})*"
    patterns = []
    if label:
        patterns.append(f"({pressure}){state}({label}){state}|({label})({pressure}){state}")
    if digits:
        numbered = f"({words})0*{digits}"
        patterns.append(f"({pressure}){state}({numbered}){state}|({numbered})({pressure}){state}")
        # Compounds name kind and pressure before number or label, in whole words: no `Kp2`.
        compound = "".join(
            f"({table.make_alternatives(one, WHOLE_WORD)})" for one in (kind, "pressure")
        )
        patterns.append(f"{compound}({label}|0*{digits}){state}")
        patterns.append(f"({pressure})({words})({label}){state}")
        patterns.append(f"({pressure})0*{digits}{state}")
    return patterns


def _list_command_patterns(element: str, kind: str, table: NameTable) -> list[str]:
    """List the expressions of a commanded pressure: full name, then kind and number, with a word
    for it."""
    label = re.escape(normalise_name(element))
    digits = re.sub(r"\D", "", label)
    pressure, command = table.make_alternatives("pressure"), table.make_alternatives("command")
    numbered = [f"({table.make_alternatives(kind)})0*{digits}"] if digits else []
    patterns = []
    for one in ([label] if label else []) + numbered:
        named = f"({pressure})({one})|({one})({pressure})"
        patterns.append(f"({named})({command})|({command})({named})|({pressure})({command})({one})")
    return patterns


Spelled = Sequence[tuple[Column, str]]
"""Columns with their names as `normalise_name` returns them."""

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
        Names of the user by role, as `normalise_name` returns them.
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
    for pattern in _get_shaft_patterns():
        if match := re.fullmatch(pattern, text):
            place = "".join(one or "" for one in match.groups())
            return [*roles, f"shaft_torque.{re.sub('^shaft(?=.)', '', place)}"]
    for pattern in _get_temperature_patterns(any_place=is_temperature):
        if match := re.fullmatch(pattern, text):
            return [*roles, f"temperature.{match['place']}"]
    return roles


def _surround(pattern: str) -> str:
    """Return an expression with words that may precede and follow."""
    table = load_name_table()
    before, after = table.make_alternatives("before"), table.make_alternatives("after")
    return f"(?:{before})*(?:{pattern})(?:{after})*"


@cache
def _get_shaft_patterns() -> tuple[str, ...]:
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
def _get_temperature_patterns(*, any_place: bool) -> tuple[str, ...]:
    """Return expressions of temperatures: word first, place first.

    A place of any name needs a unit of temperature.
    """
    table = load_name_table()
    words, places = _list_longest_first("temperature"), _list_longest_first("place")
    state = f"(?:{table.make_alternatives('state')})*"
    listed = f"(?P<place>(?:{places})+[0-9]*)"
    patterns = [f"(?:{words}|t){listed}{state}", f"{listed}(?:{words}|t){state}"]
    if any_place:
        free = "(?P<place>[a-z][a-z0-9]*?)"
        patterns += [f"(?:{words}){free}{state}", f"{free}(?:{words}){state}"]
    return tuple(patterns)


def _list_longest_first(kind: str) -> str:
    """Return the expression of the words of a kind, so that none is cut short by its beginning."""
    return "|".join(sorted(load_name_table().words[kind], key=len, reverse=True))


_STEP = 0.05
"""Least step of a command between two samples, over the range of the channel. Rounding to eight
bits makes steps of 0.004."""
_FLAT = 0.01
"""Largest change beside a step, over the step. A pressure settles for several samples."""
_CODES = 2.5
"""Least step of a command, over the smallest change of the channel. A rounded pressure moves by one
code at a time."""
_COARSEST = 0.2
"""Largest smallest change that is taken for rounding, over the range of the channel. No sensor has
five codes; commands have few levels."""
_RESTS = 0.5
"""Least share of samples that repeat the one before: a measured pressure has noise."""
_SLOWEST = 0.05
"""Longest sample interval [s] at which a pressure is seen to settle: a few lags of a valve."""
_FEWEST = 20
"""Fewest samples that show how a channel moves."""
_WITHOUT = (
    "Without them 'drivetwin identify --bus' estimates the quantities that speeds and engine "
    "torque determine; of an automatic with converter, 'drivetwin identify' takes the commands "
    "themselves with a card that has [[changes]], see 'drivetwin schema tcu-card'"
)
"""Remedy where no pressure was recorded."""


def find_command_step(channel: Channel) -> tuple[float, float, float] | None:
    """Return time [s], value before and value after [Pa] of the largest step of a command.

    None for a measured pressure, which has noise and settles over several samples.
    """
    fresh = channel.updates
    known = np.isfinite(fresh.values)
    time, values = fresh.time[known], fresh.values[known]
    if time.size < _FEWEST or np.median(np.diff(time)) > _SLOWEST or not _rests(values):
        return None
    sizes, extent = np.abs(np.diff(values)), float(np.ptp(values))
    code = float(np.min(sizes, where=sizes > 0.0, initial=np.inf))
    least = max(_STEP * extent, _CODES * code if code <= _COARSEST * extent else 0.0)
    beside = np.maximum(sizes[:-2], sizes[2:])
    alone = (sizes[1:-1] > least) & (beside < _FLAT * sizes[1:-1])
    if not alone.any():
        return None
    place = 1 + int(np.argmax(np.where(alone, sizes[1:-1], 0.0)))
    return float(time[place + 1]), float(values[place]), float(values[place + 1])


def _rests(values: FloatArray) -> bool:
    """Return True if most samples repeat the one before, as no measured pressure does."""
    return bool(np.mean(np.diff(values) == 0.0) >= _RESTS)


def check_commands(channels: Mapping[str, Channel]) -> list[Finding]:
    """Report each channel that is mapped as a pressure and steps like a command."""
    found = []
    for role, channel in channels.items():
        element = get_pressure_element(role)
        step = None if element is None else find_command_step(channel)
        if element is not None and step is not None:
            shown = {"before": step[1] / BAR, "after": step[2] / BAR, "time": step[0]}
            found.append(report(Code.PRESSURE_STEPS, "", channel.place, element=element, **shown))
    return found


def refuse_commands(log: ShiftLog, elements: Sequence[str]) -> None:
    """Raise MissingChannelError if the pressures of `elements` are commands.

    They are mapped as pressures but step like commands, or the log has commands alone.
    """
    named = [name for name in dict.fromkeys(elements) if make_pressure_role(name) in log]
    steps = {name: find_command_step(log[make_pressure_role(name)]) for name in named}
    stepping = {name: one for name, one in steps.items() if one is not None}
    where = Where(file=log.source)
    if stepping:
        name, (time, before, after) = next(iter(stepping.items()))
        pressures = {one: log[make_pressure_role(one)] for one in named}
        alike = [one for one in named if one in stepping or _rests(pressures[one].updates.values)]
        columns = ", ".join(repr(pressures[one].source_name) for one in alike)
        better = ", ".join(map(make_command_role, alike))
        raise MissingChannelError(
            f"mapped as pressures, these step like commands: {columns}; the one of {name} goes "
            f"from {before / BAR:.3g} to {after / BAR:.3g} bar between two samples at {time:.3f} s",
            f"map them as {better}, and record the pressures at the clutches. {_WITHOUT}",
            where,
        )
    roles = dict.fromkeys(map(make_command_role, elements))
    commands = [log[role] for role in roles if role in log]
    if commands and not named:
        listed = ", ".join(repr(one.source_name) for one in commands)
        stepwise = [one for one in commands if find_command_step(one) is not None]
        why = "these step like commands" if stepwise else "these are commands by their name"
        raise MissingChannelError(
            f"no clutch pressure is measured; {why}: {listed}",
            f"record the pressures at the clutches beside their commands. {_WITHOUT}",
            where,
        )
