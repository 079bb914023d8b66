# SPDX-License-Identifier: MIT
"""Gears of built-in gearboxes: as a dual clutch, and against the ratios of a log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from scipy.optimize import linear_sum_assignment

from drivetwin.errors import CardError, DrivetwinError
from drivetwin.gearbox import list_builtin_gearboxes, load_gearbox, reduce, solve_gear
from drivetwin.gearbox.reduction import ElementRatios

FIT = 0.01
"""Largest relative difference between the ratios of a log and those of a gearbox."""
SAME_RATIOS = 1e-6
"""Relative difference below which the ratios of an element in two shifts are the same."""


@dataclass(frozen=True)
class GearboxElement:
    """The element that makes a gear, with its ratios in the dual-clutch form."""

    gear: str
    ratio: float
    element: str
    kind: str
    i_c: float
    i_out: float


@dataclass(frozen=True)
class GearboxFit:
    """A built-in gearbox whose gears have the ratios of a log, and the largest difference."""

    name: str
    gears: tuple[str, ...]
    difference: float


@cache
def list_forward_gears(name: str) -> dict[str, float]:
    """List the ratios of the forward gears of a gearbox by gear, from low to high."""
    box = load_gearbox(name)
    ratios = {gear.name: solve_gear(box, gear.name).ratio for gear in box.gears}
    forward = {gear: ratio for gear, ratio in ratios.items() if ratio > 0.0}
    return dict(sorted(forward.items(), key=lambda item: -item[1]))


def match_gearboxes(ratios: Sequence[float]) -> list[GearboxFit]:
    """Find the built-in gearboxes that have all the `ratios`, the nearest first."""
    fits = []
    for name in list_builtin_gearboxes():
        gears = list_forward_gears(name)
        if not ratios or len(ratios) > len(gears):
            continue
        apart = np.abs(np.log(np.outer(ratios, 1.0 / np.array(list(gears.values())))))
        rows, columns = linear_sum_assignment(apart**2)
        difference = float(np.expm1(apart[rows, columns].max()))
        if difference <= FIT:
            names = tuple(list(gears)[column] for column in columns)
            fits.append(GearboxFit(name, names, difference))
    return sorted(fits, key=lambda one: one.difference)


@cache
def reduce_gears(name: str, gears: tuple[str, ...]) -> tuple[GearboxElement, ...]:
    """Return the elements of neighbouring `gears` (from low to high) of a gearbox.

    Raises CardError where the gears have no common dual-clutch form, with the reason.
    """
    box = load_gearbox(name)
    known = list_forward_gears(name)
    missing = [gear for gear in gears if gear not in known]
    if missing or len(gears) < 2:
        what = f"no gear {', '.join(missing)}" if missing else "one gear alone makes no card"
        listed = ", ".join(known)
        raise CardError(f"{name}: {what}", f"choose two or more of {listed} with --gears")
    gears = tuple(sorted(gears, key=lambda gear: -known[gear]))
    found: dict[str, ElementRatios] = {}
    for low, high in pairwise(gears):
        try:
            shift = reduce(box, low, high)
        except DrivetwinError as fault:
            raise CardError(
                f"{name}: the shift {low}-{high} has no dual-clutch form: {fault.what}",
                "choose gears of a shift between two clutches or brakes with --gears, or state "
                "ratios and elements yourself with --ratios and --element",
            ) from fault
        for gear, ratios in ((low, shift.off_going), (high, shift.on_coming)):
            if ratios.element in (*box.dogs, *box.freewheels):
                kind = box.elements[ratios.element].kind.value
                raise CardError(
                    f"{name}: gear {gear} is engaged by {ratios.element}, a {kind}, which no "
                    "pressure lets slip",
                    "state ratios and the clutch yourself with --ratios and --element; "
                    "examples/vehicles/manual.toml is such a card",
                )
            if not _is_same(found.setdefault(gear, ratios), ratios):
                raise CardError(
                    f"{name}: gear {gear} is made by {found[gear].element} in one shift and by "
                    f"{ratios.element} in the other, or with other ratios",
                    "write a card for each pair of gears: --gears LOW,HIGH",
                )
    elements = [found[gear].element for gear in gears]
    twice = next((one for one in elements if elements.count(one) > 1), None)
    if twice is not None:
        raise CardError(
            f"{name}: {twice} makes several of the gears {', '.join(gears)}",
            "write a card for each pair of gears: --gears LOW,HIGH",
        )
    return tuple(
        GearboxElement(
            gear,
            round(found[gear].ratio, 6),
            found[gear].element,
            box.elements[found[gear].element].kind.value,
            round(found[gear].i_c, 6),
            round(found[gear].i_out, 6),
        )
        for gear in gears
    )


def refuse_irreducible(name: str) -> None:
    """Raise CardError if no two neighbouring gears of a gearbox have a dual-clutch form."""
    faults = []
    for pair in pairwise(list_forward_gears(name)):
        try:
            reduce_gears(name, pair)
        except CardError as fault:
            faults.append(fault)
        else:
            return
    raise faults[0]


def _is_same(one: ElementRatios, other: ElementRatios) -> bool:
    apart = (abs(one.i_c / other.i_c - 1.0), abs(one.i_out / other.i_out - 1.0))
    return one.element == other.element and max(apart) <= SAME_RATIOS
