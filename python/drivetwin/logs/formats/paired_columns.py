# SPDX-License-Identifier: MIT
"""Tables in which each channel has a time column of its own name beside it.

Tools that export channels of several rates into one table write `Time_EngTrq, EngTrq` (bench
recorders), `EngTrq Time, EngTrq ValueY` (trends of process control) or `EngTrq [s], EngTrq [Nm]`.
The partner is found by the name alone: without the word for time it is the name of another column.
No order of the columns is assumed.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from drivetwin.channels.names import can_be_time
from drivetwin.channels.units import is_time_unit

_BEFORE = re.compile(
    r"(?:time[ _-]?stamps?|zeitstempel|time|zeit|timestamps?)[ _.\-/:]*(?:of |von )?(.+)"
    r"|t[ _.\-/:]+(.+)|(?:t|time|zeit) ?\((.+)\)",
    re.IGNORECASE,
)
_BEHIND = re.compile(
    r"(.+?)[ _.\-/:]*(?:time[ _-]?stamps?|zeitstempel|timestamps?|time|zeit)|(.+?)[ _.\-/:]+t",
    re.IGNORECASE,
)
_VALUE = re.compile(r"(.+?)[ _.\-/:]*(?:value ?y?|wert|y)", re.IGNORECASE)
"""Name of a column of values where both columns of a pair have a word of their own."""

_LEAST_PAIRS = 2
"""Fewer pairs are no layout: a table with one time column is read as any other."""


def find_pairs(names: Sequence[str], units: Sequence[str | None]) -> Mapping[int, int] | None:
    """Return the time column of each channel of a table of pairs.

    Parameters
    ----------
    names, units : sequence
        Names and units of the columns, in file order.

    Returns
    -------
    mapping of int to int or None
        Index of the time column by the index of each column; a time column is its own. None where
        a named column has no partner or two, since the table then is no table of pairs.
    """
    plain = [name.strip().casefold() for name in names]
    pairs: dict[int, int] = {}
    clocks: set[int] = set()
    for clock, (name, unit) in enumerate(zip(names, units, strict=True)):
        partners = _find_partners(clock, plain, units) if name and can_be_time(unit) else []
        if len(partners) == 1 and partners[0] not in clocks:
            if partners[0] in pairs:
                return None
            pairs[partners[0]] = clock
            clocks.add(clock)
    named = {index for index, name in enumerate(names) if name}
    if len(pairs) < _LEAST_PAIRS or clocks & set(pairs) or named - clocks - set(pairs):
        return None
    return {**pairs, **{clock: clock for clock in clocks}}


def _find_partners(clock: int, plain: Sequence[str], units: Sequence[str | None]) -> list[int]:
    """Return the columns whose time a column may be: none if its name is that of no time."""
    name, unit = plain[clock], units[clock]
    others = [index for index in range(len(plain)) if index != clock and plain[index]]
    if unit is not None and is_time_unit(unit):
        alike = [one for one in others if plain[one] == name and not is_time_unit(units[one] or "")]
        if alike:
            return alike
    stems = {
        stem.strip()
        for form in (_BEFORE, _BEHIND)
        if (match := form.fullmatch(name))
        for stem in match.groups()
        if stem
    }
    exact = [one for one in others if plain[one] in stems]
    return exact or [
        one for one in others if (match := _VALUE.fullmatch(plain[one])) and match[1] in stems
    ]
