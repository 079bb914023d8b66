# SPDX-License-Identifier: MIT
"""Number format: display units, with the digits that the confidence interval supports."""

from __future__ import annotations

from drivetwin._util.display_units import format_uncertainty, get_display_unit

Interval = tuple[float, float]

_EXACT = 1e-5
"""Relative half width below which a value is printed as exact."""


def format_estimate(
    value: float | None, interval: Interval | None, si_unit: str
) -> tuple[str, str, str]:
    """Value, `± half width` of its interval, and the unit they are in; a dash for None."""
    display = get_display_unit(si_unit)
    if value is None:
        return "–", "", display.label
    half = None if interval is None else (interval[1] - interval[0]) / 2.0 * display.factor
    if half is not None and half < _EXACT * abs(value * display.factor):
        half = None
    number, width = format_uncertainty(value * display.factor, half)
    return number, f"± {width}" if width else "", display.label


def format_deviation(value: float | None, truth: float) -> str:
    """Format the deviation from the true value in percent; empty if undefined."""
    return "" if value is None or truth == 0.0 else f"{100.0 * (value / truth - 1.0):+z.2f}"
