# SPDX-License-Identifier: MIT
"""Global search by CMA-ES from several seeds, the best of which are continued.

Source: N. Hansen, The CMA evolution strategy: a tutorial, arXiv:1604.00772 (2016).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.optional_dependencies import import_extra
from drivetwin._util.progress import notify_progress
from drivetwin.calibration.settings import CalibrationSettings

Evaluate = Callable[[Sequence[FloatArray]], list[float]]
"""Objectives of candidates: coordinates (q,) from 0 to 1."""

_EDGE = 1e-3
"""Distance of a start from the bounds: the search has no room on them."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """Coordinates (q,) and their objective."""

    coordinates: FloatArray
    value: float


def search_minima(
    evaluate: Evaluate, start: FloatArray, settings: CalibrationSettings, seed: int
) -> list[Candidate]:
    """Return the minima of the finalists, best first.

    Raises MissingExtraError without the library `cma`.
    """
    cma = require_search()
    searches = [
        _start_search(cma, start, settings, seed + number) for number in range(settings.starts)
    ]
    rest = settings.evaluations - settings.first_evaluations
    total = settings.starts * settings.first_evaluations + settings.finalists * rest
    done = _advance(searches, evaluate, settings.first_evaluations, (0, total))
    searches.sort(key=lambda one: float(one.best.f))
    finalists = searches[: settings.finalists]
    _advance(finalists, evaluate, settings.evaluations, (done, total))
    found = [Candidate(np.asarray(one.best.x), float(one.best.f)) for one in finalists]
    return sorted(found, key=lambda one: one.value)


def require_search() -> Any:
    """Return the library of the search. Raises MissingExtraError without it."""
    return import_extra("cma", "calibrate", "the search of a calibration", Path("calibrate"))


def _start_search(cma: Any, start: FloatArray, settings: CalibrationSettings, seed: int) -> Any:
    options = {
        "bounds": [0.0, 1.0],
        "seed": seed + 1,  # 0 would take the clock
        "popsize": settings.population,
        "verbose": -9,
    }
    begin = np.clip(start, _EDGE, 1.0 - _EDGE)
    return cma.CMAEvolutionStrategy(begin, settings.initial_step, options)


def _advance(
    searches: Sequence[Any], evaluate: Evaluate, evaluations: int, progress: tuple[int, int]
) -> int:
    """Continue each search to a number of evaluations; return the number done in all."""
    done, total = progress
    for search in searches:
        while search.countevals < evaluations and not search.stop():
            candidates = search.ask()
            search.tell(candidates, evaluate([np.asarray(one) for one in candidates]))
            done += len(candidates)
            notify_progress(done / total)
    return done
