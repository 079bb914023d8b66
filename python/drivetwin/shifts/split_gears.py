# SPDX-License-Identifier: MIT
"""Gears held between two shifts of one log, divided in their middle: no sample counts twice."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from drivetwin.shifts.shift import Shift


def compute_exclusive_spans(shifts: Sequence[Shift]) -> tuple[tuple[float, float], ...]:
    """The span [s] that each shift of one log accounts for.

    Each then starts in a gear that is surely held, and ends before the next shift's pressures act.
    """
    borders = _compute_borders(shifts)
    starts = [shifts[0].before[0], *borders]
    ends = [*borders, shifts[-1].after[1]]
    return tuple(
        (max(start, one.before[0]), min(end, one.after[1]))
        for start, end, one in zip(starts, ends, shifts, strict=True)
    )


def split_shared_gears(shifts: Sequence[Shift]) -> tuple[Shift, ...]:
    """The shifts of one log with the gears between them divided, so that they share no sample."""
    spans = compute_exclusive_spans(shifts)
    return tuple(
        replace(one, before=(start, one.before[1]), after=(one.after[0], end))
        for one, (start, end) in zip(shifts, spans, strict=True)
    )


def compute_exclusive_masks(
    shifts: Sequence[Shift], times: Sequence[NDArray[np.float64]]
) -> tuple[NDArray[np.bool_], ...]:
    """Masks (n,) of the samples that are each shift's own.

    `times` (n,) [s] belong to what was made of each shift of one log. Put together, what is left
    of them increases as each of them does.
    """
    borders = _compute_borders(shifts)
    return tuple(
        np.searchsorted(borders, time, side="right") == place for place, time in enumerate(times)
    )


def _compute_borders(shifts: Sequence[Shift]) -> list[float]:
    """Middle of each gear held between two shifts; where what counts of it for the one ends before
    what counts for the other begins, the beginning of the latter."""
    return [
        b.before[0]
        if a.after[1] <= b.before[0]
        else 0.5 * (max(a.after[0], b.before[0]) + b.before[1])
        for a, b in pairwise(shifts)
    ]
