# SPDX-License-Identifier: MIT
"""Codes of SAE J1939-71 that are no values: not available, error, reserved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.channels.shiftlog import FloatArray
from drivetwin.logs.formats.frames import Signal

_BYTE = 8
_FIRST_SPECIAL, _ERROR = 0xFB, 0xFE


@dataclass(frozen=True, eq=False)
class CodeCheck:
    """Mask of the codes that are values (n,), and counts of the other codes by meaning."""

    valid: NDArray[np.bool_]
    absent: int
    error: int
    reserved: int

    @property
    def note(self) -> str | None:
        """Description of the dropped codes; None if no code was dropped."""
        named = (
            (self.absent, "not available"),
            (self.error, "marked as error"),
            (self.reserved, "outside the valid range"),
        )
        parts = [f"{count} {what}" for count, what in named if count]
        if not parts:
            return None
        return f"{', '.join(parts)} of {self.valid.size} samples left out"


def check_codes(raw: NDArray[np.int64], values: FloatArray, signal: Signal) -> CodeCheck:
    """Classify codes `raw` (n,), whose values (n,) are in the signal's unit.

    All bits set: not available; a single bit has no code for that. From one byte on, a first byte
    of 0xFE is an error and 0xFB to 0xFD are reserved. Else the limits that the database states
    decide; they come first, because some short signals use all their codes.
    """
    all_set = (raw == (1 << signal.length) - 1) & (signal.length > 1)
    if signal.length >= _BYTE:
        top = raw >> (signal.length - _BYTE)
        absent, error = top == 0xFF, top == _ERROR
        beyond = (top >= _FIRST_SPECIAL) & (top < _ERROR)
    else:
        absent = all_set
        error = np.zeros(raw.shape, np.bool_)
        beyond = np.zeros(raw.shape, np.bool_)
    if signal.limits is not None:
        half = 0.5 * abs(signal.scale)
        outside = (values < signal.limits[0] - half) | (values > signal.limits[1] + half)
        if signal.length < _BYTE:
            absent &= outside
            error = outside & ~absent
        else:
            beyond |= outside & ~absent & ~error
    valid = ~(absent | error | beyond)
    return CodeCheck(valid, int(absent.sum()), int(error.sum()), int(beyond.sum()))
