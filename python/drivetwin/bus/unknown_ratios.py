# SPDX-License-Identifier: MIT
"""Ratios at which the speeds rest and that no gear of the card has."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from drivetwin.bus.phases import sample_speeds
from drivetwin.bus.recording import BusLog
from drivetwin.findings import Code, Finding, report
from drivetwin.plausibility.entries import PLAUSIBILITY
from drivetwin.plausibility.ratios import HeldRatio, find_held_ratios, merge_equal_ratios
from drivetwin.vehicle.ratio_card import RatioCard
from drivetwin.vehicle.spec import PriorValue

RESTS = 1.0
"""Shortest rest of a ratio [s] that only a gear explains: the input speed of an open gearbox falls
or rises."""


def find_unknown_ratios(logs: Iterable[BusLog], card: RatioCard) -> list[HeldRatio]:
    """Find the ratios that rest for `RESTS` and differ from all gears by more than the tolerance.

    The tolerance is that of a rounded ratio, or the 95 % interval on the card where it is wider.
    """
    found = merge_equal_ratios(
        one
        for log in logs
        for stretch in log.stretches
        for one in find_held_ratios(sample_speeds(log, stretch, 0.0), RESTS)
    )
    return [one for one in found if not any(is_ratio(one, gear) for gear in card.ratios.values())]


def is_ratio(found: HeldRatio, gear: PriorValue) -> bool:
    """Return True if a ratio that is held can be this one of the card."""
    tolerance = max(PLAUSIBILITY.ratio_tolerance * gear.value, gear.half_width or 0.0)
    return abs(found.ratio - gear.value) <= tolerance


def report_unknown_ratios(found: Sequence[HeldRatio], card: RatioCard) -> list[Finding]:
    """Report all ratios that are on no gear of the card, in one finding; empty without one."""
    if not found:
        return []
    ratios = ", ".join(f"{one.ratio:.4g} for {one.time:.1f} s" for one in found)
    gears = ", ".join(f"{name} {one.value:.4g}" for name, one in card.ratios.items())
    return [report(Code.BUS_RATIO_UNKNOWN, ratios=ratios, gears=gears)]
