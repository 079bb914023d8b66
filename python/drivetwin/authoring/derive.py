# SPDX-License-Identifier: MIT
"""Answers that follow from other answers, from a log, or from a built-in gearbox."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise

import numpy as np
from scipy.optimize import linear_sum_assignment

from drivetwin.authoring.log_survey import LogSurvey, assign_pressures
from drivetwin.authoring.question import (
    Answer,
    Answers,
    Key,
    Origin,
    get_value,
    list_gears,
    merge_answers,
)
from drivetwin.authoring.stated_number import StatedNumber
from drivetwin.errors import CardError, DrivetwinError, Where
from drivetwin.gearbox import list_builtin_gearboxes, load_gearbox, reduce, solve_gear
from drivetwin.gearbox.reduction import ElementRatios
from drivetwin.plausibility.entries import PLAUSIBILITY
from drivetwin.vehicle.card import RATIO_TOLERANCE
from drivetwin.vehicle.spec import describe_wheel_radius

FIT = 0.01
"""Largest relative difference between the ratios of a log and those of a gearbox."""
SAME_RATIOS = 1e-6
"""Relative difference below which the ratios of an element in two shifts are the same."""


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
def reduce_gears(name: str, gears: tuple[str, ...]) -> dict[str, ElementRatios]:
    """Return the element of each of neighbouring `gears` of a gearbox, from low to high.

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
    return {gear: found[gear] for gear in gears}


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


GEOMETRY = frozenset((
    "surfaces", "derating", "area_m2", "radius_m", "outer_mm", "inner_mm", "piston_outer_mm",
    "piston_inner_mm",
))  # fmt: skip
"""Parts of an element from which its gain is computed."""
WHEELS = 1.1
"""Factor on the inertia of a vehicle's mass for that of wheels and axles."""


def derive_answers(answers: Answers, survey: LogSurvey | None) -> dict[Key, Answer]:
    """Return the answers with all that follows from them; stated ones take precedence.

    Raises CardError where the gears of a stated gearbox have no dual-clutch form, and where ratios
    or diameters contradict each other.
    """
    known = merge_answers(answers.items(), _derive_gearbox(answers))
    known = merge_answers(known.items(), _spread_common(known))
    _check_ratios(known)
    if survey is not None:
        known = merge_answers(known.items(), _label_elements(known, survey))
    return merge_answers(known.items(), _derive_geometry(known), _derive_vehicle(known))


def _derive_gearbox(answers: Answers) -> Iterator[tuple[Key, Answer]]:
    name, names = get_value(answers, "gearbox"), get_value(answers, "gears", "names")
    if name is None or names is None:
        return
    note = f"computed from the built-in gearbox {name}"
    elements = reduce_gears(name, names)
    yield (
        ("gears", "ratios"),
        Answer(tuple(StatedNumber.compute(one.ratio) for one in elements.values()), note=note),
    )
    yield ("gears", "elements"), Answer(tuple(one.element for one in elements.values()), note=note)
    for one in elements.values():
        kind = load_gearbox(name).elements[one.element].kind.value
        yield ("elements", one.element, "kind"), Answer(kind, note=note)
        for part, ratio in (("i_c", one.i_c), ("i_out", one.i_out)):
            yield ("elements", one.element, part), Answer(StatedNumber.compute(ratio), note=note)


def _spread_common(answers: Answers) -> Iterator[tuple[Key, Answer]]:
    """Give each element what is stated for all."""
    common = {key[2]: one for key, one in answers.items() if key[0] == "elements" and not key[1]}
    for gear in list_gears(answers):
        own = {key[2] for key in answers if key[:2] == ("elements", gear.element)}
        for part, answer in common.items():
            if not (own & GEOMETRY if part == "gain_m3" else part in GEOMETRY and "gain_m3" in own):
                yield ("elements", gear.element, part), answer


def _check_ratios(answers: Answers) -> None:
    """Raise CardError where kind or ratios of an element do not make its gear."""
    for gear in list_gears(answers):
        kind, i_c, i_out = (
            get_value(answers, "elements", gear.element, part) for part in ("kind", "i_c", "i_out")
        )
        what = None
        if kind == "brake" and gear.ratio == 1.0 and i_c is None:
            what = f"{gear.element} is a brake, which cannot make gear {gear.name} with ratio 1"
        elif i_c and i_out and abs(i_c * i_out / gear.ratio - 1.0) > RATIO_TOLERANCE:
            what = (
                f"i_c·i_out of {gear.element} is {i_c * i_out:.4g}, but gear {gear.name} has "
                f"{gear.ratio:g}"
            )
        if what is not None:
            raise CardError(what, "correct the element or the ratio", Where(key="--element"))


def _label_elements(answers: Answers, survey: LogSurvey) -> Iterator[tuple[Key, Answer]]:
    """Name the pressure of the log that belongs to each element, by the ratio of its gear."""
    labels = assign_pressures(survey.gears)
    for gear in list_gears(answers):
        for held, label in zip(survey.gears, labels, strict=True):
            if label and abs(held.ratio / gear.ratio - 1.0) <= PLAUSIBILITY.ratio_tolerance:
                note = f"high while {survey.name} holds gear {gear.name}"
                key = ("elements", gear.element, "label")
                yield key, Answer(label, Origin.GUESS, note)


def _derive_geometry(answers: Answers) -> Iterator[tuple[Key, Answer]]:
    """Effective radius of the lining, and area of the piston, from their diameters."""
    for gear in list_gears(answers):
        for ring, part, compute in (
            ("", "radius_m", compute_effective_radius),
            ("piston_", "area_m2", compute_area),
        ):
            diameters = [
                get_value(answers, "elements", gear.element, f"{ring}{side}_mm")
                for side in ("outer", "inner")
            ]
            if None in diameters:
                continue
            if not diameters[1] < diameters[0]:
                raise CardError(
                    f"the inner diameter {diameters[1]:g} mm of {gear.element} is not below the "
                    f"outer diameter {diameters[0]:g} mm",
                    f"correct {ring}inner_mm or {ring}outer_mm",
                    Where(key="--element"),
                )
            value = compute(*(5e-4 * one for one in diameters))
            note = f"from the diameters {diameters[0]:g} mm and {diameters[1]:g} mm"
            yield ("elements", gear.element, part), Answer(float(f"{value:.6g}"), note=note)


def compute_area(outer: float, inner: float) -> float:
    """Return the area [m^2] of a ring with radii `outer` > `inner` [m]."""
    return math.pi * (outer**2 - inner**2)


def compute_effective_radius(outer: float, inner: float) -> float:
    """Return the effective radius [m] of a lining between two radii [m].

    It is that of a uniform pressure: (2/3) (R³ - r³)/(R² - r²).
    """
    return 2.0 / 3.0 * (outer**3 - inner**3) / (outer**2 - inner**2)


def _derive_vehicle(answers: Answers) -> Iterator[tuple[Key, Answer]]:
    """J3 of a mass on wheels: m·r², and up to a tenth more for wheels and axles.

    The radius counts with two standard deviations to either side, as a single mass does.
    """
    mass, radius = get_value(answers, "vehicle", "mass"), get_value(answers, "wheel_radius")
    if mass is None or radius is None:
        return
    low, high = mass
    spread = 2.0 * radius.to_prior(describe_wheel_radius).std
    note = (
        f"{low:.4g} to {high:.4g} kg times the square of {radius:g} ± {spread:.2g} m; wheels add "
        "up to 10 %"
    )
    limits = (
        float(f"{low * (radius - spread) ** 2:.4g}"),
        float(f"{WHEELS * high * (radius + spread) ** 2:.4g}"),
    )
    yield ("inertia", "J_vehicle"), Answer(limits, note=note)
