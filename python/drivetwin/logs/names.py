# SPDX-License-Identifier: MIT
"""What the name of a column tells beside its name: a unit in brackets, that it is time."""

from __future__ import annotations

import re
from collections.abc import Sequence

from drivetwin.errors import MappingError, MissingChannelError, Where
from drivetwin.logs.raw import TimeColumn
from drivetwin.logs.units import is_unit
from drivetwin.tomlfile import did_you_mean

_TIME_NAMES = frozenset(
    ("t", "time", "times", "timestamp", "timestamps", "zeit", "zeitstempel", "messzeit", "tout")
)


def name_and_unit(cell: str) -> tuple[str, str | None]:
    """`EngTrq [Nm]` -> name and unit; round brackets count where they hold a unit.

    `x[1]` without a blank is an index, part of the name.
    """
    if match := re.fullmatch(r"(.+?)(\s*)\[([^\[\]]*)\]", cell):
        name, blank, inside = match.groups()
        if blank or not inside.isdigit():
            return name, inside.strip() or None
    if (match := re.fullmatch(r"(.+?)\s*\(([^()]*)\)", cell)) and is_unit(match[2]):
        return match[1], match[2].strip()
    return cell, None


def is_time_name(name: str) -> bool:
    """Tell whether a column of this name is taken for time."""
    return re.sub(r"[^a-z]", "", name.casefold()) in _TIME_NAMES


def time_index(names: Sequence[str], time: TimeColumn, file: str) -> int:
    """Return the index of the time column: as stated, else the one with a name for time.

    Raises MappingError where there are several, MissingChannelError where there is none.
    """
    if time.source is not None:
        found = [index for index, name in enumerate(names) if name == time.source]
    else:
        found = [index for index, name in enumerate(names) if is_time_name(name)]
    if len(found) == 1:
        return found[0]
    where = Where(file=file)
    remedy = 'name the time column in a channel mapping: time = { source = "...", unit = "s" }'
    if found:
        listed = ", ".join(names[index] for index in found)
        raise MappingError(f"several time columns: {listed}", remedy, where)
    if time.source is not None:
        what = f"no column {time.source!r} for time{did_you_mean(time.source, names)}"
    else:
        what = f"no time column among {', '.join(names)}"
    raise MissingChannelError(what, remedy, where)
