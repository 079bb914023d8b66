# SPDX-License-Identifier: MIT
"""Unit and time detection from column names, and `names.toml` as regular expressions."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import chain
from pathlib import Path

from pydantic import Field

from drivetwin._util.toml import StrictModel, read_toml
from drivetwin.channels.roles import TimeColumn
from drivetwin.channels.units import find_unit, is_time_unit, is_unit
from drivetwin.errors import MappingError, MissingChannelError, Where, suggest_spelling

_FILE = Path(__file__).with_name("names.toml")


class _Hint(StrictModel):
    name: str
    why: str


class _RoleNames(StrictModel):
    phrases: list[str] = Field(default_factory=list)
    names: list[str] = Field(default_factory=list)
    hints: list[_Hint] = Field(default_factory=list)


class _NamesFile(StrictModel):
    words: dict[str, list[str]]
    roles: dict[str, _RoleNames]


@dataclass(frozen=True)
class NameTable:
    """Words by kind, regular expression of the names of each role, and its hints.

    All are in the form of `normalise_name`. `hints` are reasons by name: names of quantities that
    are related to the role but not the same. `vocabulary` are all words and whole names.
    """

    words: Mapping[str, tuple[str, ...]]
    patterns: Mapping[str, str]
    hints: Mapping[str, Mapping[str, str]]
    vocabulary: frozenset[str]

    def make_alternatives(self, kind: str, least: int = 1) -> str:
        """Return the expression of the words of a kind that have at least `least` letters."""
        return "|".join(word for word in self.words[kind] if len(word) >= least)


_ASIDE = re.compile(r"\\.*$|\[[^\]]*\]|(?:_\d+ms|_+x?(?:etkc?|ccp|cp)_\d+)$", re.DOTALL)
"""Parts of a name beside the quantity: device (`\\XETK:1`, elsewhere `_XETK_1`), unit, raster."""


def normalise_name(name: str) -> str:
    """Reduce a column name to letters and digits for comparison: `n_Ab [1/min]` -> `nab`."""
    text = _ASIDE.sub("", unicodedata.normalize("NFC", name).casefold())
    for umlaut, letters in (("ä", "ae"), ("ö", "oe"), ("ü", "ue"), ("ß", "ss"), ("ω", "w")):
        text = text.replace(umlaut, letters)
    return re.sub(r"[^a-z0-9]", "", text)


@cache
def load_name_table() -> NameTable:
    """Read the table of names."""
    file = _NamesFile.model_validate(read_toml(_FILE, MappingError))
    words = {kind: tuple(map(normalise_name, some)) for kind, some in file.words.items()}
    return NameTable(
        words=words,
        patterns={role: _make_pattern(one, words) for role, one in file.roles.items()},
        hints={
            role: {normalise_name(hint.name): hint.why for hint in one.hints}
            for role, one in file.roles.items()
        },
        vocabulary=frozenset(
            chain(
                *words.values(),
                (normalise_name(name) for one in file.roles.values() for name in one.names),
            )
        ),
    )


def _make_pattern(role: _RoleNames, words: Mapping[str, tuple[str, ...]]) -> str:
    """Return the expression that a name of a role matches as a whole."""
    phrases = ("".join(_make_word(word, words) for word in one.split()) for one in role.phrases)
    return "|".join((*phrases, *map(normalise_name, role.names)))


def _make_word(word: str, words: Mapping[str, tuple[str, ...]]) -> str:
    """Return the expression of a word in a phrase: `engine`, `engine?` or `engine*`."""
    kind, repeat = (word[:-1], word[-1]) if word[-1] in "?*" else (word, "")
    return f"({'|'.join(words[kind])}){repeat}"


_TIME_NAMES = frozenset(
    (
        *("t", "time", "times", "timestamp", "timestamps", "tout", "elapsedtime", "xvalue"),
        *("zeit", "zeitstempel", "messzeit", "uhrzeit"),
    )
)


def split_name_and_unit(cell: str) -> tuple[str, str | None]:
    """`EngTrq [Nm]` -> name and unit; round brackets count where they hold a unit.

    `x[1]` without a blank is an index, part of the name. A time may have its unit behind
    it, as `time_ms` or `t in ms`.
    """
    if match := re.fullmatch(r"(.+?)(\s*)\[([^\[\]]*)\]", cell):
        name, blank, inside = match.groups()
        if blank or not inside.isdigit():
            return name, inside.strip() or None
    if (match := re.fullmatch(r"(.+?)\s*\(([^()]*)\)", cell)) and is_unit(match[2]):
        return match[1], match[2].strip()
    match = re.fullmatch(r"(.+?)(?:[_.\- ]in)?[_.\- ]([^\W\d_]+)", cell)
    if match and is_time_unit(match[2]) and is_time_name(match[1]):
        return match[1], match[2]
    return cell, None


_CLOCKS = ("devicetime", "localtime", "systemtime", "triptime", "gpstime", "utctime")
"""Names of the clocks of a phone or logger, the best first: that of GPS counts whole seconds."""


def is_time_name(name: str) -> bool:
    """Return True if a column of this name is taken for time; remarks in round brackets aside."""
    return re.sub(r"[^a-z]", "", name.casefold()) in _TIME_NAMES or is_clock_name(name)


def is_clock_name(name: str) -> bool:
    """Return True for the name of a clock of a phone or logger, as `GPS Time`."""
    return _strip_remarks(name) in _CLOCKS


def _strip_remarks(name: str) -> str:
    return re.sub(r"\([^()]*\)|[^a-z]", "", name.casefold())


def rank_clocks(names: Sequence[str], found: Sequence[int]) -> list[int]:
    """Return the time columns `found`, of several named after clocks the best first."""
    if not all(is_clock_name(names[index]) for index in found):
        return list(found)
    return sorted(found, key=lambda index: _CLOCKS.index(_strip_remarks(names[index])))


def can_be_time(unit: str | None) -> bool:
    """Return True if a column of this unit may be a time: none, a time unit or an unknown one."""
    return unit is None or is_time_unit(unit) or find_unit(unit) is None


def find_time_indices(
    names: Sequence[str], units: Sequence[str | None], time: TimeColumn
) -> list[int]:
    """Return the indices of all time columns: as stated, else those with a name for time.

    A column of another unit, such as a temperature `T1`, is none. Without such a name it is the
    first column, if that is the only one in a unit of time.
    """
    if time.source is not None:
        return [index for index, name in enumerate(names) if name == time.source]
    named = [
        index
        for index, (name, unit) in enumerate(zip(names, units, strict=True))
        if is_time_name(name) and can_be_time(unit)
    ]
    plain = [index for index in named if not is_clock_name(names[index])]
    named = plain or named
    timed = [index for index, unit in enumerate(units) if unit is not None and is_time_unit(unit)]
    return named or (timed if timed == [0] else [])


def find_time_index(
    names: Sequence[str], units: Sequence[str | None], time: TimeColumn, file: str
) -> int:
    """Return the index of the one time column, see `find_time_indices`.

    Raises MappingError where there are several, MissingChannelError where there is none.
    """
    found = find_time_indices(names, units, time)
    if len(found) == 1:
        return found[0]
    where = Where(file=file)
    remedy = 'name the time column in a channel mapping: time = { source = "...", unit = "s" }'
    if found:
        listed = ", ".join(names[index] for index in found)
        raise MappingError(f"several time columns: {listed}", remedy, where)
    if time.source is not None:
        what = f"no column {time.source!r} for time{suggest_spelling(time.source, names)}"
    else:
        what = f"no time column among {', '.join(names)}{_describe_other_units(names, units)}"
    raise MissingChannelError(what, remedy, where)


def _describe_other_units(names: Sequence[str], units: Sequence[str | None]) -> str:
    """Describe the columns that have a name for time but another unit."""
    shown = [
        f"{name!r} is in {unit!r}"
        for name, unit in zip(names, units, strict=True)
        if is_time_name(name) and not can_be_time(unit)
    ]
    return f"; {', '.join(shown)}, no unit of time" if shown else ""
