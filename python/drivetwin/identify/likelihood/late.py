# SPDX-License-Identifier: MIT
"""Whether the output torque comes later than the speeds.

A torque sensor's filter delays it by some milliseconds, which moves c_o by several standard
deviations and hardly shows in Q. The fit takes torque and speeds for simultaneous; how late the
torque would be if it were free follows from its rate of change as one more column.
"""

from __future__ import annotations

import numpy as np

from drivetwin.identify.likelihood.fit import LikelihoodFit, covariance_of
from drivetwin.identify.likelihood.problem import Part
from drivetwin.identify.likelihood.score import score_of
from drivetwin.identify.likelihood.unknowns import Point
from drivetwin.identify.result import Z95
from drivetwin.identify.signals import FloatArray

TORQUE = "output_torque"
SIGNIFICANT = 5.0
"""Delay in its standard deviations from which it is told."""


def late_torque(fit: LikelihoodFit) -> tuple[float, float]:
    """How late the output torque is against the speeds, and the standard deviation of that [s].

    To first order, all unknowns free; (0, inf) where there is no output torque.
    """
    columns = [_column(part, fit.point) for part in fit.problem.parts]
    score = score_of(fit.problem, fit.normal, columns)
    followed = score.cross.T @ covariance_of(fit.normal.information) @ score.cross
    left = float((score.own - followed)[0, 0])
    if left <= 0.0:
        return 0.0, float("inf")
    return float(score.pull[0]) / left, float(np.sqrt(max(fit.chi2, 1.0) / left))


def lateness_in_words(fit: LikelihoodFit) -> list[str]:
    """What is said of an output torque that is late or early."""
    delay, std = late_torque(fit)
    if abs(delay) < SIGNIFICANT * std:
        return []
    side = "late" if delay > 0.0 else "early"
    return [
        f"the output torque is {1e3 * abs(delay):.1f} ± {1e3 * Z95 * std:.1f} ms {side} against "
        "the speeds, if the model of the shaft holds: c_o and ζ hang on it; set "
        f"channels.output_torque.time_shift_s = {-delay:.4f} in the channel mapping and compare"
    ]


def _column(part: Part, point: Point) -> FloatArray:
    """Change (n, 1) of the outputs of one part per second by which the output torque is late."""
    found, first = np.zeros((part.record.size, 1)), 0
    for out in part.record.outputs:
        rows = slice(first, first + out.values.size)
        first = rows.stop
        if out.name == TORQUE:
            run = part.run(point)
            assert run is not None, "a fit can be simulated"
            found[rows, 0] = -out.seen(run.time, np.gradient(run.shaft_torque, run.time))
    return found
