# SPDX-License-Identifier: MIT
"""Display units and number formats."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin._util.display_units import (
    BAR,
    RPM,
    format_significant,
    format_uncertainty,
    format_with_unit,
    get_display_unit,
    spell_unit,
)
from drivetwin.parameters import SPECS
from drivetwin.shifts.quality import QUALITY_UNITS


def test_si_is_converted_for_display() -> None:
    assert RPM.to_display(np.array([2.0 * np.pi])) == pytest.approx([60.0])
    assert BAR.to_display(np.array([1.4e6])) == pytest.approx([14.0])


@pytest.mark.parametrize("spec", SPECS.values(), ids=lambda spec: spec.stem)
def test_every_parameter_unit_has_a_display_without_ascii_stars(spec: object) -> None:
    label = get_display_unit(getattr(spec, "unit")).label  # noqa: B009
    assert label
    assert "*" not in label
    assert "^" not in label


@pytest.mark.parametrize(
    ("value", "half", "shown"),
    [
        (17.5034, 0.1234, ("17.50", "0.12")),
        (176_012.0, 1234.0, ("176\u202f000", "1\u202f200")),
        (0.85, None, ("0.8500", "")),
        (0.85, 0.0, ("0.8500", "")),
        (-3.21e-4, 2e-5, ("−0.000321", "0.000020")),
        (0.9, 1.9e-7, ("0.900000", "1.9e-07")),
        (2300.4, 0.96, ("2\u202f300.40", "0.96")),
    ],
)
def test_value_and_half_width_share_their_last_digit(
    value: float, half: float | None, shown: tuple[str, str]
) -> None:
    assert format_uncertainty(value, half) == shown


@pytest.mark.parametrize(
    ("value", "text"),
    [(0.0, "0"), (float("nan"), "–"), (123456.0, "123\u202f500"), (1.5e-9, "1.500e-09")],
)
def test_significant_digits(value: float, text: str) -> None:
    assert format_significant(value) == text


@pytest.mark.parametrize(
    ("value", "unit", "half", "text"),
    [
        (96_300.0, "Pa", 7400.0, "0.963 ± 0.074 bar"),
        (0.0144, "s", None, "14.40 ms"),
        (0.85, "1", 0.012, "0.850 ± 0.012"),
        (4.9, "N*m*s^2/rad^2", 0.31, "4.90 ± 0.31 Nm·s²/rad²"),
        (17.5, "kg*m^2", 0.0, "17.50 kg·m²"),
    ],
)
def test_a_sentence_has_the_units_of_the_tables(
    value: float, unit: str, half: float | None, text: str
) -> None:
    assert format_with_unit(value, unit, half) == text


@pytest.mark.parametrize("unit", sorted(set(QUALITY_UNITS.values())))
def test_no_figure_of_shift_quality_has_a_unit_in_ascii(unit: str) -> None:
    assert not set("*^") & set(get_display_unit(unit).label)


@pytest.mark.parametrize(
    ("unit", "spelled"),
    [("m/s^3", "m/s³"), ("m/s^1.75", "m/s¹·⁷⁵"), ("N*m*s^2/rad^2", "Nm·s²/rad²"), ("Pa", "Pa")],
)
def test_an_si_unit_is_spelled_as_its_display(unit: str, spelled: str) -> None:
    assert spell_unit(unit) == spelled


@pytest.mark.parametrize("value", [-0.0, -1e-320])
def test_a_negative_zero_has_no_sign(value: float) -> None:
    assert format_uncertainty(value, 0.5)[0] == "0.00"
    assert format_with_unit(value, "Pa", 1e3) == "0.000 ± 0.010 bar"
    assert format_significant(-0.0) == "0"
