# SPDX-License-Identifier: MIT
"""Readings of fields in words."""

from __future__ import annotations

import pytest

from drivetwin.fleet.rules import format_reading, format_span, get_drift_unit, parse_field_value


def test_dates_are_written_as_they_were_read() -> None:
    first, last = parse_field_value("date", "2024-02-29"), parse_field_value("date", "2025-02-28")
    assert format_reading("date", first) == "2024-02-29"
    assert format_span("recorded_date", first, last) == "2024-02-29 and 2025-02-28"
    factor, per = get_drift_unit("recorded_date")
    assert per == "year"
    assert factor / (last - first) == pytest.approx(365.25 / 365.0)


def test_numbers_keep_the_name_of_their_field() -> None:
    assert format_span("odometer_Mm", 119.2543, 123.0) == "119.3 and 123 odometer_Mm"
    assert format_span("odometer_km", 98764.0, 123456.0) == "98760 and 123500 odometer_km"
    assert format_reading("odometer_km", 123456.0) == "123456"
    assert get_drift_unit("odometer_Mm") == (1.0, "odometer_Mm")
