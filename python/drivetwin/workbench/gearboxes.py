# SPDX-License-Identifier: MIT
"""A gearbox as the workbench shows it: members, gears, application table, reduced shifts."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

from drivetwin.errors import DrivetwinError, InputError
from drivetwin.gearbox import (
    CouplingError,
    Gearbox,
    Reduction,
    compare,
    estimate,
    reduce,
    solve_gear,
)


@dataclass(frozen=True)
class GearLine:
    """One gear: computed and published ratio, and the elements engaged in it."""

    name: str
    ratio: float
    published: float
    elements: tuple[str, ...]

    @property
    def difference(self) -> float:
        """Computed over published ratio, less 1."""
        return self.ratio / self.published - 1.0


@dataclass(frozen=True)
class MemberLine:
    """A rotating member: its inertia [kg m^2], and the sets, pairs and elements that join it."""

    name: str
    inertia: float
    joined: tuple[str, ...]


@dataclass(frozen=True)
class ReducedShift:
    """A shift as a dual clutch, and the error of neglecting the coupling, if it can be computed."""

    reduction: Reduction
    estimated: CouplingError | None = None
    simulated: CouplingError | None = None
    reason: str = ""


def list_gears(box: Gearbox) -> list[GearLine]:
    """All gears in the order of the card. Raises InputError where elements make no ratio."""
    return [
        GearLine(gear.name, solve_gear(box, gear.name).ratio, gear.published, gear.elements)
        for gear in box.gears
    ]


def list_members(box: Gearbox) -> list[MemberLine]:
    """All members with what joins them, input first and output last."""
    joined: dict[str, list[str]] = {}
    for one in box.sets:
        for part, member in (("sun", one.sun), ("ring", one.ring), ("carrier", one.carrier)):
            joined.setdefault(member, []).append(f"{part} of {one.name}")
    for pair in box.pairs:
        for member in (pair.a, pair.b):
            joined.setdefault(member, []).append(f"pair {pair.name}")
    for element in box.elements.values():
        for member in (element.a, element.b):
            joined.setdefault(member, []).append(element.name)
    order = sorted(joined, key=lambda name: (name == box.output, name != box.input))
    return [MemberLine(one, box.inertias.get(one, 0.0), tuple(joined[one])) for one in order]


def list_shifts(box: Gearbox) -> dict[str, tuple[str, str]]:
    """Neighbouring gears (old, new) by the name of their shift, such as `2-3`."""
    return {f"{old.name}-{new.name}": (old.name, new.name) for old, new in pairwise(box.gears)}


def reduce_shift(box: Gearbox, shift: str) -> ReducedShift:
    """One shift in the dual-clutch form.

    Raises InputError for a text that is no shift, ReductionError where there is no such form.
    """
    shifts = list_shifts(box)
    if shift not in shifts:
        raise InputError(f"{shift!r} is no shift", f"choose one of {', '.join(shifts)}")
    reduction = reduce(box, *shifts[shift])
    try:
        return ReducedShift(reduction, estimate(reduction), compare(reduction).error)
    except DrivetwinError as error:
        return ReducedShift(reduction, reason=error.what)
