# SPDX-License-Identifier: MIT
"""Distributions of numbers by their written digits."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin._util.toml import parse_toml
from drivetwin.vehicle.spec import (
    PriorValue,
    describe_ratio,
    parse_teeth,
)

DIGIT_STD = 3.0**-0.5
"""Standard deviation of a number within one unit of its last digit, in units of that digit."""


def read_ratio(text: str) -> PriorValue:
    """Distribution of a ratio as a file states it."""
    return describe_ratio(parse_toml(f"ratio = {text}")["ratio"])


@given(st.floats(0.2, 20.0), st.integers(1, 6), st.booleans())
def test_a_rounded_or_cut_ratio_lies_within_a_unit_of_its_last_digit(
    true: float, digits: int, is_cut: bool
) -> None:
    scale = 10.0**digits
    written = math.floor(true * scale) / scale if is_cut else round(true, digits)
    prior = read_ratio(f"{written:.{digits}f}")
    if written != 1.0:
        assert prior.std == pytest.approx(DIGIT_STD / scale)
        assert abs(true - prior.value) <= 1.0001 * prior.std / DIGIT_STD


@pytest.mark.parametrize(
    ("text", "std"),
    [
        ("1.50", DIGIT_STD * 1e-2),
        ("1.485", DIGIT_STD * 1e-3),
        ("1.485e0", DIGIT_STD * 1e-3),
        ("2", DIGIT_STD * 1e-1),
        ("2.0", DIGIT_STD * 1e-1),
        ("1", 0.0),
        ("1.0", 0.0),
        ("1.00", 0.0),
    ],
)
def test_the_text_of_a_ratio_states_its_precision(text: str, std: float) -> None:
    assert read_ratio(text).std == pytest.approx(std)


def test_a_ratio_whose_text_is_lost_has_six_digits() -> None:
    assert describe_ratio(1.48452).std == pytest.approx(DIGIT_STD * 1e-5)
    assert describe_ratio(0.618).std == pytest.approx(DIGIT_STD * 1e-6)


def test_tooth_counts_are_exact() -> None:
    assert parse_teeth("49/33") == 49 / 33
    assert parse_teeth(" 49 / 33 * 41/20") == pytest.approx(49 / 33 * 41 / 20)
    for text in ("49:33", "49/0", "a/b", "49/33*"):
        with pytest.raises(ValueError, match=r"49|without teeth|no ratio"):
            parse_teeth(text)
