# SPDX-License-Identifier: MIT
"""Readings of a field as people write them: dates as dates, drifts of dates per year."""

from __future__ import annotations

from datetime import UTC, datetime

from drivetwin.fleet.rules import is_date

_YEAR = 365.25 * 86400.0


def to_datetime(reading: float) -> datetime:
    """The point in time of a date's reading [s since 1970]."""
    return datetime.fromtimestamp(reading, UTC)


def format_reading(field: str, reading: float) -> str:
    """One reading: an ISO date, or the number alone to six digits."""
    if is_date(field):
        return to_datetime(reading).date().isoformat()
    return f"{reading:g}"


def format_span(field: str, low: float, high: float) -> str:
    """Two readings and what they are of, e.g. `119.2 and 123 odometer_Mm`; four digits do."""
    if is_date(field):
        return f"{format_reading(field, low)} and {format_reading(field, high)}"
    ends = (f"{float(f'{each:.4g}'):g}" for each in (low, high))
    return " and ".join(ends) + f" {field}"


def get_drift_unit(field: str) -> tuple[float, str]:
    """Return the factor and the unit by which a change per unit of the field is displayed."""
    return (_YEAR, "year") if is_date(field) else (1.0, field)
