# SPDX-License-Identifier: MIT
"""Which codes are values, by J1939-71."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.logs.formats.can.database import Signal
from drivetwin.logs.formats.can.j1939 import check_codes


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
