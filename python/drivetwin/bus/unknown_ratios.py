# SPDX-License-Identifier: MIT
"""Ratios at which the speeds rest and that no gear of the card has."""

from __future__ import annotations

from collections.abc import Iterable

from drivetwin.bus.phases import sample_speeds
from drivetwin.bus.recording import BusLog
from drivetwin.shifts.held_ratios import (
    RESTS,
    HeldRatio,
    find_held_ratios,
    is_ratio,
    merge_equal_ratios,
)
from drivetwin.vehicle.ratio_card import RatioCard


def find_unknown_ratios(logs: Iterable[BusLog], card: RatioCard) -> list[HeldRatio]:
    """Find the ratios that rest for `RESTS` and are on no gear of the card."""
    found = merge_equal_ratios(
        one
        for log in logs
        for stretch in log.stretches
        for one in find_held_ratios(sample_speeds(log, stretch, 0.0), RESTS)
    )
    return [one for one in found if not any(is_ratio(one, gear) for gear in card.ratios.values())]
