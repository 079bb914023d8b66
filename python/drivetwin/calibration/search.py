# SPDX-License-Identifier: MIT
"""Global search by short polishes: from random starts, then from hops of a pool of the best.

Source: D. Wales and J. Doye, Global optimization by basin-hopping, J. Phys. Chem. A 101 (1997).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import notify_progress
from drivetwin.calibration.settings import CalibrationSettings

_POOL = 6
"""Minima from which hops start."""
_CLOSE = 0.02
"""Largest distance of coordinates at which two minima count as one."""
_RANK = 1.2
"""Scale of the exponential law by which a hop chooses the rank of its minimum."""
_PARTIAL, _PARTIAL_STEP = 0.3, 2.5
"""Share of the coordinates that a partial hop moves, and its step over that of a full one."""
_CROSS_STEP = 0.3
"""Step of a hop between two minima, over that of a full one."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """Coordinates (q,) and their objective."""

    coordinates: FloatArray
    value: float


def search_minima(
    improve: Callable[[FloatArray], Candidate],
    start: FloatArray,
    settings: CalibrationSettings,
    seed: int,
) -> list[Candidate]:
    """Return the pool of minima, best first.

    `improve` polishes coordinates (q,) and returns them with the objective on other draws.
    """
    random = np.random.default_rng([seed, 5])
    total, pool = settings.starts + settings.hops, list[Candidate]()
    for number in range(total):
        notify_progress(number / total)
        if number == 0:
            at = start
        elif number < settings.starts:
            at = start + settings.initial_step * random.standard_normal(start.size)
        else:
            at = _hop(pool[:_POOL], settings.hop_step, random)
        found = improve(np.clip(at, 0.0, 1.0))
        near = [one for one in pool if np.abs(one.coordinates - found.coordinates).max() < _CLOSE]
        if all(found.value < one.value for one in near):
            others = (one for one in pool if one not in near)
            pool = sorted([*others, found], key=lambda one: one.value)
    return pool[:_POOL]


def _hop(pool: list[Candidate], step: float, random: np.random.Generator) -> FloatArray:
    """Move from a minimum of the pool: all coordinates, some, or towards another minimum."""
    at = pool[min(int(random.exponential(_RANK)), len(pool) - 1)].coordinates
    noise, kind = random.standard_normal(at.size), random.random()
    if kind < 0.5:
        return at + step * noise
    if kind < 0.75:
        return at + _PARTIAL_STEP * step * noise * (random.random(at.size) < _PARTIAL)
    other = pool[int(random.integers(len(pool)))].coordinates
    return at + random.uniform(-0.3, 1.3) * (other - at) + _CROSS_STEP * step * noise
