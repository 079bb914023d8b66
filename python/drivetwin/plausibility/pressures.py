# SPDX-License-Identifier: MIT
"""P0 of the card against the pressures of a log."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from drivetwin.channels.pressure_roles import make_pressure_role
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.channels.units import BAR
from drivetwin.findings import Code, Finding, report
from drivetwin.plausibility.entries import find_entry
from drivetwin.plausibility.ratios import find_log_ratios, is_held
from drivetwin.plausibility.spans import sample_span
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.vehicle_card import VehicleCard

ABOVE = 1.2
"""Least ratio of the largest pressure of an element that engages to its P0."""
DRAG = 0.3
"""Pressure above P0 that an open element may have [bar]: sensor offset, prefill."""


def check_pressures(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift], doubted: frozenset[str]
) -> list[Finding]:
    """Report each P0 that the pressures of the log exclude; `doubted` elements are left out.

    An element is looked at where the log holds its gear or shifts to it.
    """
    findings = {
        element: finding
        for element, finding in (*_check_largest(log, card), *_check_open(log, card, shifts))
        if element not in doubted
    }
    return list(findings.values())


def _check_largest(log: ShiftLog, card: VehicleCard) -> Iterator[tuple[str, Finding]]:
    held = find_log_ratios(log, card)
    for name, element in card.elements.items():
        role = make_pressure_role(name)
        engages = any(
            name in gear.elements and is_held(gear.ratio.value, held) for gear in card.gears
        )
        if role not in log or not engages:
            continue
        largest, P0 = float(np.nanmax(log[role].values)), element.P0.value
        if largest < ABOVE * P0:
            shown = {"found": P0 / BAR, "low": 0.0, "high": largest / BAR}
            place = find_entry(card, f"elements.{name}.P0_bar")
            yield name, report(Code.CARD_FILL_ABOVE_LOG, "", place, element=name, **shown)


def _check_open(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift]
) -> Iterator[tuple[str, Finding]]:
    """Compare P0 with the pressure of each on-coming element well before its shift."""
    for shift in shifts:
        role = make_pressure_role(shift.oncoming)
        if role not in log or shift.oncoming == shift.offgoing:
            continue
        if log[role].source_name == _find_source(log, shift.offgoing):
            continue  # one pressure for both
        first, last = shift.before
        values = sample_span(log[role], (first, first + 0.7 * (last - first)))
        known = values[np.isfinite(values)]
        P0 = card.get_element(shift.oncoming).P0.value
        if known.size < 10 or (resting := float(np.median(known))) < P0 + DRAG * BAR:
            continue
        place = find_entry(card, f"elements.{shift.oncoming}.P0_bar")
        shown = {"found": P0 / BAR, "low": resting / BAR}
        names = {"element": shift.oncoming, "gear": shift.start_gear}
        yield shift.oncoming, report(Code.CARD_FILL_BELOW_LOG, "", place, **names, **shown)


def _find_source(log: ShiftLog, element: str) -> str:
    role = make_pressure_role(element)
    return log[role].source_name if role in log else ""
