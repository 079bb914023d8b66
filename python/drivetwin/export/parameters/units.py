# SPDX-License-Identifier: MIT
"""SI units in ASCII, such as `N*m*s/rad`, as powers of base units."""

from __future__ import annotations

import re
from fractions import Fraction

from drivetwin.errors import InputError

_BASE = {
    "kg": {"kg": 1},
    "m": {"m": 1},
    "s": {"s": 1},
    "rad": {"rad": 1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "Hz": {"s": -1},
    "1": {},
}
_FACTOR = re.compile(r"([A-Za-z]+|1)(?:\^(\d+(?:\.\d+)?))?")


def parse_base_units(unit: str) -> dict[str, int] | None:
    """Powers of kg, m, s and rad behind a unit; None where they are not whole numbers.

    What follows a `/` is one denominator, with or without parentheses. Raises InputError for a
    unit that is not made of these.
    """
    powers: dict[str, Fraction] = {}
    for sign, group in _parse_groups(unit):
        for name, power in group:
            for base, own in _BASE[name].items():
                powers[base] = powers.get(base, Fraction(0)) + sign * power * own
    if any(power.denominator != 1 for power in powers.values()):
        return None
    return {base: int(power) for base, power in powers.items() if power}


def is_same_unit(stated: str, expected: str) -> bool:
    """Return True if the unit in a file is `expected`; a missing unit, `1`, is accepted.

    Units with equal base units are the same, e.g. `Pa` and `N/m^2`.
    """
    if stated in ("1", expected):
        return True
    try:
        return parse_base_units(stated) == parse_base_units(expected)
    except InputError:
        return False


def _parse_groups(unit: str) -> list[tuple[int, list[tuple[str, Fraction]]]]:
    numerators, *denominators = unit.replace("(", "").replace(")", "").split("/")
    return [
        (sign, [_parse_factor(part, unit) for part in group.split("*")])
        for sign, group in ((1, numerators), *((-1, each) for each in denominators))
    ]


def _parse_factor(text: str, unit: str) -> tuple[str, Fraction]:
    found = _FACTOR.fullmatch(text.strip())
    if found is None or found[1] not in _BASE:
        raise InputError(
            f"unit {unit!r} is not made of {', '.join(_BASE)}", "write it in SI, as in N*m*s/rad"
        )
    return found[1], Fraction(found[2] or 1)
