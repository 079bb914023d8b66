# SPDX-License-Identifier: MIT
"""A shift between two gears of a twin, without times."""

from __future__ import annotations

from itertools import pairwise

from drivetwin.errors import InputError
from drivetwin.shifts.shift import Shift
from drivetwin.twin.twin import Twin
from drivetwin.vehicle.shift_kind import ShiftKind


def build_nominal_shift(twin: Twin, gears: tuple[str, str] | None) -> Shift:
    """The shift between two gears without times, as far as a model needs it."""
    start, end = gears or _find_first_shift(twin)
    elements = twin.get_gear(start).element, twin.get_gear(end).element
    if elements[0] == elements[1]:
        raise InputError(
            f"gears {start!r} and {end!r} of {twin.name!r} are held by the same element",
            "choose two neighbouring gears",
        )
    never = (0.0, 0.0)
    kind = ShiftKind.POWER_ON_UP
    return Shift(start, end, *elements, kind, never, never, never, never, 0.0)


def _find_first_shift(twin: Twin) -> tuple[str, str]:
    """First pair of neighbouring gears with a friction curve."""
    for old, new in pairwise(twin.gears):
        held = (twin.gears[old].element, twin.gears[new].element)
        if held[0] != held[1] and any(name in twin.friction for name in held):
            return old, new
    raise InputError(
        f"the twin {twin.name!r} has no neighbouring gears with an identified friction curve",
        "name the shift with --shift, such as --shift 2-3",
    )
