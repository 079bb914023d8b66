# SPDX-License-Identifier: MIT
"""Design ranges of inertia against the torque balance of a log."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin._util.arrays import Span
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.findings import Code, Finding, report
from drivetwin.plausibility.entries import find_entry
from drivetwin.plausibility.friction import find_single_slip, get_slipping
from drivetwin.plausibility.settings import PLAUSIBILITY, Limits
from drivetwin.plausibility.spans import compute_engine_rate, compute_mean, compute_output_rate
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.card_fields import get_card_field
from drivetwin.vehicle.vehicle_card import VehicleCard

LEAST_WINDOWS = 6
"""Fewest windows of a vehicle balance."""
WINDOW = 0.4
"""Width of the windows of the vehicle balance [s]."""
CORRELATED = 0.9
"""Least correlation of torque and acceleration."""


def estimate_engine_inertia(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift]
) -> Limits | None:
    """Estimate J' [kg m^2] at the engine from inertia phases, for the usual efficiencies.

    J' ω_e' = T_e - T_o/(η i) with the ratio i of the slipping element; independent of its gain.
    None without both torques, with a converter, or without a deceleration that is large enough.
    """
    if card.converter is not None or not {"engine_torque", "output_torque"} <= set(log.channels):
        return None
    found: list[Limits] = []
    for shift in shifts:
        i_c, i_out = card.get_clutch_ratios(get_slipping(shift)[0])
        span = find_single_slip(log, card, shift)
        if span is None:
            continue
        rate = compute_engine_rate(log, card, span)
        driving = compute_mean(log["engine_torque"], span)
        torque = compute_mean(log["output_torque"], span)
        inertia = 0.0 if card.J_out is None else card.J_out.value
        turning = compute_output_rate(log, card, span)
        torque += inertia * turning if np.isfinite(turning) else 0.0
        bounds = [
            (driving - torque / (eta * i_c * i_out * card.i_in.value)) / rate
            for eta in get_card_field("eta").usual
        ]
        if np.isfinite(bounds).all() and min(bounds) > 0.0:
            found.append((min(bounds), max(bounds)))
    if not found:
        return None
    return float(np.median([one[0] for one in found])), float(np.median([one[1] for one in found]))


def estimate_vehicle_inertia(log: ShiftLog, card: VehicleCard) -> Limits | None:
    """Estimate J3 [kg m^2] at the wheel from output torque and acceleration, load constant.

    Straight lines of either over the other bound the slope. None without output torque, or where
    both do not vary together.
    """
    if "output_torque" not in log:
        return None
    torque = log["output_torque"]
    first, last = float(torque.time[0]), float(torque.time[-1])
    count = int((last - first) / WINDOW)
    if count < LEAST_WINDOWS:
        return None
    spans: list[Span] = [(first + k * WINDOW, first + (k + 1) * WINDOW) for k in range(count)]
    rates = np.array([compute_output_rate(log, card, one) for one in spans])
    driving = np.array([compute_mean(torque, one) for one in spans])
    known = np.isfinite(rates) & np.isfinite(driving)
    if np.count_nonzero(known) < LEAST_WINDOWS:
        return None
    covariance = np.cov(rates[known], driving[known])
    product = covariance[0, 1]
    if product <= 0.0 or product < CORRELATED * np.sqrt(covariance[0, 0] * covariance[1, 1]):
        return None
    at_wheel = card.final_drive.value**2
    low, high = product / covariance[0, 0], covariance[1, 1] / product
    return float(at_wheel * low), float(at_wheel * high)


def check_inertias(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift], doubted: frozenset[str]
) -> list[Finding]:
    """Report the design ranges that the torque balance contradicts; `doubted` keys are left out."""
    ranges = {
        "inertia.J_prime_kgm2": (card.J_prime_range, estimate_engine_inertia(log, card, shifts)),
        "inertia.J_vehicle_kgm2": (card.J_vehicle_range, estimate_vehicle_inertia(log, card)),
    }
    margin = PLAUSIBILITY.inertia_margin
    findings = []
    for key, (stated, measured) in ranges.items():
        if measured is None or key in doubted:
            continue
        low, high = measured
        if low > margin * stated[1] or margin * high < stated[0]:
            shown = {"found_low": stated[0], "found_high": stated[1], "low": low, "high": high}
            findings.append(report(Code.CARD_INERTIA_DIFFERS, "", find_entry(card, key), **shown))
    return findings
