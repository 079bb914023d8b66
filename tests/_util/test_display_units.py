# SPDX-License-Identifier: MIT
"""Display units and number formats."""

from __future__ import annotations

import pytest

from drivetwin._util.display_units import format_with_unit


@pytest.mark.parametrize(
    ("value", "unit", "half", "text"),
    [
        (96_300.0, "Pa", 7400.0, "0.963 ± 0.074 bar"),
        (0.0144, "s", None, "14.40 ms"),
        (0.85, "1", 0.012, "0.850 ± 0.012"),
        (4.9, "N*m*s^2/rad^2", 0.31, "4.90 ± 0.31 Nm·s²/rad²"),
        (17.5, "kg*m^2", 0.0, "17.50 kg·m²"),
        (17.5034, "1", 0.1234, "17.50 ± 0.12"),
        (176_012.0, "1", 1234.0, "176\u202f000 ± 1\u202f200"),
        (-3.21e-4, "1", 2e-5, "−0.000321 ± 0.000020"),
        (0.9, "1", 1.9e-7, "0.900000 ± 1.9e-07"),
        (-1e-320, "Pa", 1e3, "0.000 ± 0.010 bar"),
        (-0.0, "1", None, "0"),
        (float("nan"), "1", None, "–"),
    ],
)
def test_value_and_half_width_share_their_last_digit(
    value: float, unit: str, half: float | None, text: str
) -> None:
    assert format_with_unit(value, unit, half) == text
