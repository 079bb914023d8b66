# SPDX-License-Identifier: MIT
"""Second slips after the polish of a calibration: polish again with the units that show them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.metrics import Outcome
from drivetwin.calibration.objective import Objective


@dataclass(frozen=True, eq=False)
class Held:
    """Coordinates (q,), and the draws of the check (n,) that joined those of the polish."""

    coordinates: FloatArray
    joined: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Exchange:
    """Polish with the draws of a check that slip again after their lock-up.

    A second slip is so rare that the draws of a polish miss it. `assess` returns the outcome of
    coordinates (q,) over the draws of the check, `improve` the coordinates after a polish in which
    the marked draws (n,) of the check take part. Rounds end when no unit slips again, or one gains
    nothing.

    Source: exchange method of J. Blankenship and J. Falk, Infinitely constrained optimization
    problems, J. Optimization Theory and Applications 19 (1976).
    """

    assess: Callable[[FloatArray], Outcome]
    improve: Callable[[FloatArray, NDArray[np.bool_]], FloatArray]
    rounds: int

    def hold_lockup(self, start: FloatArray, objective: Objective) -> Held:
        """Return the coordinates of the least objective over the draws of the check."""
        outcome = self.assess(start)
        best = Held(start, np.zeros(outcome.relocked.size, np.bool_))
        least = objective.evaluate(outcome)
        for _ in range(self.rounds):
            if not outcome.relocked.any():
                break
            joined = best.joined | outcome.relocked
            tried = self.improve(best.coordinates, joined)
            outcome = self.assess(tried)
            value = objective.evaluate(outcome)
            if value >= least:
                break
            best, least = Held(tried, joined), value
        return best
