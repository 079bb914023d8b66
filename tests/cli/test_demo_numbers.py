# SPDX-License-Identifier: MIT
"""Numbers as printed."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import pytest

from drivetwin import cli
from drivetwin.cli.demo import format_deviation, format_estimate
from drivetwin.report.blocks import Column, make_table


def test_digits_follow_the_interval() -> None:
    assert format_estimate(17.50312, (17.37, 17.63), "kg*m^2") == ("17.50", "± 0.13", "kg·m²")


def test_display_units() -> None:
    assert format_estimate(80500.0, (79500.0, 81500.0), "Pa") == ("0.805", "± 0.010", "bar")
    assert format_estimate(0.0101, (0.0098, 0.0104), "s") == ("10.10", "± 0.30", "ms")


def test_a_known_value_has_no_interval() -> None:
    assert format_estimate(80000.0, (80000.0 - 1e-5, 80000.0 + 1e-5), "Pa") == ("0.8000", "", "bar")


def test_what_is_not_known_is_a_dash() -> None:
    assert format_estimate(None, None, "1")[0] == "–"


@pytest.mark.parametrize(
    ("value", "truth", "text"),
    [
        (18.0, 17.5, "+2.86"),
        (17.5, 17.5, "+0.00"),
        (17.4999, 17.5, "+0.00"),
        (None, 17.5, ""),
        (0.01, 0.0, ""),
    ],
)
def test_deviation(value: float | None, truth: float, text: str) -> None:
    assert format_deviation(value, truth) == text


def test_a_negative_zero_has_no_sign() -> None:
    columns: Sequence[Column] = (("fit", ".1f"), ("off", "+.2f"), ("size", "3"))
    ((fit, off, size),) = make_table("", columns, [(-0.04, -0.001, -0.0)]).rows
    assert (fit.text, off.text, size.text) == ("0.0", "+0.00", "0")
    assert format_estimate(-0.0, (-0.5, 0.5), "N*m")[0] == "0.00"


def test_no_table_of_a_command_prints_a_negative_zero() -> None:
    """Decimals of numbers that may be negative are formatted with `z`."""
    signed = re.compile(r"\{[^{}]*(?:min|max|bias|start|end|low|high|torque)[^{}]*:\+?,?\.\df\}")
    found = [
        f"{path.name}: {text}"
        for path in sorted(Path(cli.__file__).parent.glob("*.py"))
        for text in signed.findall(path.read_text(encoding="utf-8"))
    ]
    assert found == []
