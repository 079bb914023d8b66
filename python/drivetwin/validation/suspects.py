# SPDX-License-Identifier: MIT
"""Entries of the card that are most likely wrong where a model fails its gate."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from drivetwin.estimation.data.shift_data import PLAUSIBLE_ETA
from drivetwin.estimation.identification import Identification
from drivetwin.findings import Code, Finding, report
from drivetwin.parameters import FINAL_DRIVE, get_parameter_spec

LEAST_SIZE = 3.0
"""Deviation, in usual standard deviations, from which an efficiency is no scatter."""
SHOWN = 2
"""Entries that are named."""
TYPICAL_FRICTION = 0.11
"""Usual μ of a wet clutch."""
SPREAD_OF_FRICTION = 0.35
"""Standard deviation of ln μ over linings and oils."""
RATIO_STD = 1e-3
"""Rounding of ratios on cards, relative."""
INERTIA_STD = 0.3
"""Standard deviation of ln J outside a design range."""

Suspect = tuple[float, str]
"""Deviation of an entry in its usual standard deviations, and the entry in words."""


def find_suspects(found: Identification, friction: tuple[float, float]) -> list[Finding]:
    """Name the entries whose correction would have to be largest, at most `SHOWN`.

    `friction` is the range of μ that needs no explanation.
    """
    ranked = sorted(
        (
            *_rank_gains(found, friction),
            *_rank_efficiency(found),
            *_rank_findings(found),
            *_rank_inertias(found),
        ),
        reverse=True,
    )
    return [report(Code.CARD_SUSPECT, entry=entry, size=size) for size, entry in ranked[:SHOWN]]


def find_undetermined_gains(found: Identification, failures: Iterable[Finding]) -> list[Finding]:
    """Name the elements without friction of their own in shifts that the simulation misses.

    Such an element never slips under load in the log. Its torque decides when it breaks away.
    """
    missed = {
        row.names["shift"]
        for one in failures
        if one.code is Code.SIMULATION_OUTSIDE_SPREAD
        for row in one.rows
    }
    pairs = {
        (element, other)
        for shift in found.shifts
        if f"{shift.start_gear}-{shift.end_gear}" in missed
        for element, other in (
            (shift.offgoing, shift.oncoming),
            (shift.oncoming, shift.offgoing),
        )
        if not found.has_own_friction(element) and found.has_own_friction(other)
    }
    return [
        report(Code.GAIN_NOT_DETERMINED, element=element, other=other)
        for element, other in sorted(pairs)
    ]


def _rank_gains(found: Identification, friction: tuple[float, float]) -> Iterator[Suspect]:
    for name, curve in found.friction.items():
        middle = float(np.median(curve.mu))
        if (
            not curve.is_borrowed
            and not curve.over_eta
            and not friction[0] <= middle <= friction[1]
            and middle > 0.0
        ):
            factor = middle / TYPICAL_FRICTION
            size = abs(float(np.log(factor))) / SPREAD_OF_FRICTION
            yield size, f"gain of {name} (μ would be {middle:.3g}; {factor:.2g} times the gain)"


def _rank_efficiency(found: Identification) -> Iterator[Suspect]:
    """Rank scale and unit of the torques by the efficiency that they make."""
    eta = found.estimates.get("eta")
    if eta is not None and eta.value is not None:
        size = (PLAUSIBLE_ETA.value - eta.value) / PLAUSIBLE_ETA.std
        if size > LEAST_SIZE:
            factor = PLAUSIBLE_ETA.value / eta.value
            yield size, f"unit or scale of a torque (output torque too small by {factor:.2f}?)"


def _rank_findings(found: Identification) -> Iterator[Suspect]:
    """Rank what the reader and the estimators hold against the card."""
    for one in found.findings:
        if one.code is Code.CARD_CONTRADICTED:
            yield one.numbers["apart"].value, f"{one.subject} on the card"
        elif one.code is Code.RATIO_OFF_CARD:
            log, stated = one.numbers["log"].value, one.numbers["card"].value
            what = "final_drive" if one.subject == FINAL_DRIVE else one.names["what"]
            yield abs(log / stated - 1.0) / RATIO_STD, f"{what} ({log:.4g})"
        elif one.code is Code.RATIO_DEVIATES:
            ratio, card = one.numbers["ratio"].value, one.numbers["card"].value
            gear = one.names["gear"]
            yield abs(ratio / card - 1.0) / RATIO_STD, f"ratio of gear {gear} ({ratio:.4g})"
        elif one.code is Code.FINAL_DRIVE_DIFFERS:
            ratio, card = one.numbers["ratio"].value, one.numbers["card"].value
            yield abs(ratio / card - 1.0) / RATIO_STD, f"final_drive ({ratio:.4g})"


def _rank_inertias(found: Identification) -> Iterator[Suspect]:
    """Rank inertias outside their design ranges: a torque's scale or unit, or another vehicle."""
    settings = found.settings
    for name, one in found.estimates.items():
        limits = settings.get(f"{get_parameter_spec(name).stem}_range")
        if limits is None or one.value is None or one.value <= 0.0:
            continue
        outside = max(limits[0] / one.value, one.value / limits[1])
        if outside > 1.0:
            size = float(np.log(outside)) / INERTIA_STD
            yield size, f"design range of {name}, or scale and sign of a torque"
