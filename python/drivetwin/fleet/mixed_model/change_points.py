# SPDX-License-Identifier: MIT
"""Change points: from which log on a unit is no longer what it was, as after a repair."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import norm

from drivetwin.fleet.mixed_model.mixed import FloatArray, IntArray

FALSE_ALARMS = 0.01
"""Probability of one change found in a fleet that has none."""
_LEAST_LOGS = 8
_LEAST_PART = 3
"""Logs that a unit must have, and either side of a change."""
_SPLITS = 200
"""Places of a change that are tried within one unit."""
_CLIP = 4.0
"""Standard deviations to which a single log counts: one alone must not look like a change."""


@dataclass(frozen=True)
class Step:
    """A unit's values are larger by `size` ± `std` from `after` on; `before` is the last reading
    of the old state. `z` is the size in standard deviations.
    """

    unit: int
    before: float
    after: float
    size: float
    std: float
    z: float


def find_steps(
    unit: IntArray, reading: FloatArray, residual: FloatArray, variance: FloatArray
) -> list[Step]:
    """Steps of `residual` (n,), with its variance, over `reading` (n,) within each unit.

    A unit's own steady drift is allowed for, so that fast wear is no change. Found one after the
    other; which are real is decided against the number of places tried in the whole fleet.
    """
    members = [np.flatnonzero(unit == each) for each in range(int(unit.max()) + 1)]
    members = [rows[np.argsort(reading[rows], kind="stable")] for rows in members]
    members = [rows for rows in members if rows.size >= _LEAST_LOGS]
    tried = sum(len(_list_splits(rows.size)) for rows in members)
    if not tried:
        return []
    limit = float(norm.isf(0.5 * FALSE_ALARMS / tried))
    found: list[Step] = []
    for rows in members:
        found += _find_unit_steps(
            int(unit[rows[0]]), reading[rows], residual[rows], variance[rows], limit
        )
    return found


def _list_splits(count: int) -> IntArray:
    places = np.linspace(_LEAST_PART, count - _LEAST_PART, min(_SPLITS, count))
    return np.unique(places.astype(np.int_))


def _find_unit_steps(
    unit: int, reading: FloatArray, values: FloatArray, variance: FloatArray, limit: float
) -> list[Step]:
    """The largest step of one unit, then those on either side of it."""
    if reading.size < _LEAST_LOGS:
        return []
    step = _find_largest_step(unit, reading, values, variance)
    if step is None or abs(step.z) < limit:
        return []
    place = int(np.searchsorted(reading, step.after))
    parts: Sequence[slice] = (slice(0, place), slice(place, None))
    sides = [_find_unit_steps(unit, reading[p], values[p], variance[p], limit) for p in parts]
    return [*sides[0], step, *sides[1]]


def _find_largest_step(
    unit: int, reading: FloatArray, values: FloatArray, variance: FloatArray
) -> Step | None:
    """Find the most significant step, in addition to the unit's own level and drift."""
    places = [int(k) for k in _list_splits(reading.size) if reading[k] > reading[k - 1]]
    if not places or reading[-1] == reading[0]:
        return None
    root = np.sqrt(variance)
    centre = np.median(values)
    spread = max(float(np.median(np.abs(values - centre) / root)) * 1.4826, 1.0)
    clipped = centre + np.clip(values - centre, -_CLIP * spread * root, _CLIP * spread * root)
    line = np.column_stack([np.ones_like(reading), (reading - reading.mean()) / np.ptp(reading)])
    base, _ = np.linalg.qr(line / root[:, None])
    steps = (np.arange(reading.size)[:, None] >= np.array(places)) / root[:, None]
    steps = steps - base @ (base.T @ steps)
    target = clipped / root
    target = target - base @ (base.T @ target)
    power = np.einsum("nk,nk->k", steps, steps)
    usable = power > 1e-9
    z = np.where(usable, steps.T @ target / np.sqrt(np.where(usable, power, 1.0)), 0.0)
    best = int(np.argmax(np.abs(z)))
    place, std = places[best], float(power[best] ** -0.5)
    return Step(
        unit, float(reading[place - 1]), float(reading[place]), float(z[best] * std), std,
        float(z[best]),
    )  # fmt: skip
