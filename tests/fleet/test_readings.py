# SPDX-License-Identifier: MIT
"""Readings of fields in words."""

from __future__ import annotations

import pytest

from drivetwin.fleet.readings import drift_unit, reading_text, span_text
from drivetwin.fleet.rules import field_value


def test_dates_are_written_as_they_were_read() -> None:
    first, last = field_value("date", "2024-02-29"), field_value("date", "2025-02-28")
    assert reading_text("date", first) == "2024-02-29"
    assert span_text("recorded_date", first, last) == "2024-02-29 and 2025-02-28"
    factor, per = drift_unit("recorded_date")
    assert per == "year"
    assert factor / (last - first) == pytest.approx(365.25 / 365.0)


def test_numbers_keep_the_name_of_their_field() -> None:
    assert span_text("odometer_Mm", 119.2543, 123.0) == "119.3 and 123 odometer_Mm"
    assert span_text("odometer_km", 98764.0, 123456.0) == "98760 and 123500 odometer_km"
    assert reading_text("odometer_km", 123456.0) == "123456"
    assert drift_unit("odometer_Mm") == (1.0, "odometer_Mm")
