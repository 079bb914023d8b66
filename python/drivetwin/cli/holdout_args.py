# SPDX-License-Identifier: MIT
"""Parser of `--hold-out`: a shift by its number, a whole log, or a shift of one log."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin.errors import InputError, Where

if TYPE_CHECKING:
    from drivetwin.shifts.detect import FoundShifts


def parse_holdouts(
    wanted: Sequence[str], logs: Sequence[Path], shifts: Sequence[FoundShifts]
) -> list[frozenset[int]]:
    """Numbers of the shifts to predict, log by log, counted from 1.

    `N` is a shift of the only log, `FILE` all shifts of a log, `FILE:N` one of them; a file may be
    named with or without folder and ending. Raises InputError for what is none of these.
    """
    held: list[set[int]] = [set() for _ in logs]
    for text in wanted:
        place, number = _parse_shift(text, logs)
        every = range(1, len(shifts[place].shifts) + 1)
        held[place] |= set(every) if number is None else {number}
    return [frozenset(one) for one in held]


def _parse_shift(text: str, logs: Sequence[Path]) -> tuple[int, int | None]:
    """Place of the log, and number of the shift; None for all of them."""
    whole = _find_logs(text, logs)
    if len(whole) == 1:
        return whole[0], None
    name, _, number = text.rpartition(":")
    places = _find_logs(name, logs) if name else list(range(len(logs)))
    if not re.fullmatch(r"\d{1,9}", number) or len(places) != 1:
        raise InputError(
            f"{text!r} names no shift or log of {', '.join(log.name for log in logs)}",
            "give the number of a shift of the only log, a log, or LOG:NUMBER",
            Where(key="--hold-out"),
        )
    return places[0], int(number)


def _find_logs(name: str, logs: Sequence[Path]) -> list[int]:
    return [k for k, log in enumerate(logs) if name in (str(log), log.name, log.stem)]
