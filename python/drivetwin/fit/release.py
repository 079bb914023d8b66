# SPDX-License-Identifier: MIT
"""Release of fixed numbers at a minimum: the influential ones become coordinates with a prior.

With the priors of these coordinates, the inverse of the information at the common minimum is the
covariance of the unknowns widened by what is known roughly.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import IdentificationError
from drivetwin.fit.fixed_numbers import FixedNumber
from drivetwin.fit.plant import Problem
from drivetwin.likelihood.column_products import adjust_unknowns
from drivetwin.likelihood.covariance import invert_information
from drivetwin.likelihood.gauss_newton import OptimizeResult, minimise
from drivetwin.likelihood.point import ParameterVector
from drivetwin.vehicle.spec import PriorValue


@dataclass(frozen=True)
class ReleaseSettings:
    """Settings of the release of fixed numbers."""

    widening: float = 1e-3
    """Share in the variance of an unknown from which a number is released [ratio]: fifty of them
    hide 3 % of a standard deviation."""
    visible: float = 0.1
    """Information of the recordings over that of its prior from which a number is released."""
    reach: float = 6.0
    """Bound of a coordinate [standard deviations of the prior]."""


RELEASE = ReleaseSettings()


def release_fixed(
    found: OptimizeResult[Problem],
    fixed: Sequence[FixedNumber],
    count: int,
) -> tuple[OptimizeResult[Problem], tuple[FixedNumber, ...]]:
    """Minimise over the fixed numbers as well, each within its distribution.

    Parameters
    ----------
    found
        Minimum with the stated values of the fixed numbers.
    fixed
        Numbers beside the unknowns.
    count
        Number of unknowns of the network, which come first in the vector.

    Returns
    -------
    OptimizeResult, tuple of FixedNumber
        The common minimum, and the numbers that became coordinates of it; those without an effect
        on the unknowns or on the outputs are left out. The minimum as given where none has one.
    """
    kept = _select(found, fixed, count) if fixed else []
    if not kept:
        return found, ()
    problem, point = extend(found.problem, found.point, kept)
    for _ in range(2):  # the second with the weighting of the common minimum
        best = minimise(problem, point)
        if best is None:
            raise IdentificationError(*_FAILED)
        found, point = best, best.point
        problem = best.problem.update_weighting(point)
    return found, tuple(kept)


_FAILED = (
    "the simulation fails beside the stated values of numbers that are no unknowns",
    "state those at the edge of their range as exact, under [tolerances]",
)


def extend(
    problem: Problem, point: ParameterVector, fixed: Sequence[FixedNumber]
) -> tuple[Problem, ParameterVector]:
    """Return the problem and its point with the coordinates of the fixed numbers behind."""
    terms = [
        replace(one, plant=replace(one.plant, fixed=(*one.plant.fixed, *fixed)))
        for one in problem.terms
    ]
    wider = problem.extend(terms, [PriorValue(0.0, 1.0)] * len(fixed), RELEASE.reach)
    names = (*point.names, *(one.coordinate for one in fixed))
    return wider, ParameterVector(names, np.append(point.values, np.zeros(len(fixed))))


def _select(
    found: OptimizeResult[Problem], fixed: Sequence[FixedNumber], count: int
) -> list[FixedNumber]:
    """Select the fixed numbers that widen an unknown or that the recordings show."""
    problem, point = extend(found.problem, found.point, fixed)
    normal = problem.normal(point)
    if normal is None:
        raise IdentificationError(*_FAILED)
    shown = _find_shown(normal.information, len(found.point.names), count)
    return [one for one, is_shown in zip(fixed, shown, strict=True) if is_shown]


def _find_shown(information: FloatArray, size: int, count: int) -> NDArray[np.bool_]:
    """Find the fixed numbers that widen one of `count` unknowns or that the recordings show.

    They follow on the `size` coordinates of the search; `information` contains their priors.
    """
    inverse = invert_information(information[:size, :size])
    adjusted = adjust_unknowns(np.zeros(len(information)), information, size)
    shares = np.max(adjusted.moves[:count] ** 2 / np.diag(inverse)[:count, None], axis=0)
    return np.asarray((shares > RELEASE.widening) | (np.diag(adjusted.own) > RELEASE.visible))
