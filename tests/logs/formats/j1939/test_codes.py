# SPDX-License-Identifier: MIT
"""Which codes are values, by J1939-71."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.logs.formats.frames import Signal
from drivetwin.logs.formats.j1939.codes import check_codes


def counts(signal: Signal, *raw: int) -> tuple[int, int, int, int]:
    codes = np.array(raw, np.int64)
    values = np.asarray(signal.scale * codes + signal.offset, np.float64)
    check = check_codes(codes, values, signal)
    return int(check.valid.sum()), check.absent, check.error, check.reserved


def test_codes_of_whole_bytes() -> None:
    byte = Signal("x", 0, 8, limits=(0.0, 250.0))
    assert counts(byte, 0, 250, 251, 253, 254, 255) == (2, 1, 1, 2)
    word = Signal("x", 0, 16, scale=0.125)
    assert counts(word, 0, 0xFAFF, 0xFB00, 0xFE00, 0xFEFF, 0xFF00, 0xFFFF) == (2, 2, 2, 1)


@pytest.mark.parametrize(
    ("limits", "expected"),
    [((0.0, 1.0), (2, 1, 1, 0)), ((0.0, 3.0), (4, 0, 0, 0)), (None, (3, 1, 0, 0))],
)
def test_codes_of_two_bits_follow_the_limits(
    limits: tuple[float, float] | None, expected: tuple[int, int, int, int]
) -> None:
    assert counts(Signal("x", 0, 2, limits=limits), 0, 1, 2, 3) == expected


def test_a_single_bit_has_no_code_for_not_available() -> None:
    assert counts(Signal("x", 0, 1), 0, 1) == (2, 0, 0, 0)


def test_limits_of_a_scaled_signal_include_their_ends() -> None:
    percent = Signal("x", 0, 8, scale=1.0, offset=-125.0, limits=(-125.0, 125.0))
    assert counts(percent, 0, 125, 250) == (3, 0, 0, 0)


def test_the_note_says_what_was_left_out() -> None:
    word = Signal("x", 0, 16)
    raw = np.array([1, 0xFFFF, 0xFFFF, 0xFE00], np.int64)
    check = check_codes(raw, raw.astype(np.float64), word)
    assert check.note == "2 not available, 1 marked as error of 4 samples left out"
    assert check_codes(raw[:1], raw[:1].astype(np.float64), word).note is None
