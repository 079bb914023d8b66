# SPDX-License-Identifier: MIT
"""Damped Gauss-Newton (Levenberg 1944, Marquardt 1963) on the information matrix.

The unknowns differ by ten orders of magnitude in size; every matrix is scaled to a unit diagonal
before it is solved. The search ends where a full step would lower Q by less than a small part of
one, which is the same part of a standard deviation squared for every unknown.

Q has kinks: pressure noise about P0 fills and vents an element many times, and what moves such an
instant over a sample bends Q. A search that meets one crawls along it. There the least combination
of the gradients on its sides is what may still fall (Lemaréchal 1975), and takes its place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, lsq_linear, minimize

from drivetwin.identify.likelihood.problem import Normal, Problem
from drivetwin.identify.likelihood.retraction import ahead
from drivetwin.identify.likelihood.unknowns import Point
from drivetwin.identify.signals import FloatArray
from drivetwin.progress import tell

ENOUGH = 1e-2
"""Expected fall of Q at which the search ends: 0.1 standard deviations."""
STALLED = 0.3
"""Expected fall of Q below which a point that no step improves is a minimum all the same: at a
kink the expansion promises what no step keeps."""
CRAWLING = 0.1
"""Fall of Q over the expected one below which a step has met a kink."""
SIDES = 8
"""Most gradients about a kink that are combined."""
HALVINGS = 6
"""How often a step across a kink is halved before the other side counts as reached."""
DAMPING = 1e-3
"""First damping relative to the diagonal of the information."""
LARGEST = 1e8
"""Damping at which no step is left to try."""
MAX_STEPS = 40
ROUGH_STEPS = 20
"""Steps after which a rough search ends: one that crawls prepares nothing."""
FAR_STEPS = 8
"""Steps after which a search ends whose Q is above what is asked for: by then those that come in
from far off have not only come near but ended."""
REFRESHES = 3
"""Least number of points at which Q is formed anew: near the minimum it settles in two."""
PATIENCE = 3
"""Points in a row that are no likelier, by Q + log|Σ|, before Q stays as it was at the likeliest: a
weighting that follows may lead away, for what gives the inputs' noise more room leaves less."""
CLOSE = 10.0
"""Expected fall of Q from which on it is no longer formed anew: it may alternate about a kink.
Further off, what Q looks like from the other side of a kink cannot be told from here, so there no
way along it is looked for, until `PATIENCE` steps in a row have crawled."""

ROUGH = 1e-3
"""Fall of Q relative to Q at which a search ends that only prepares the next one."""

Refresh = Callable[[Problem, Point], Problem]


@dataclass(frozen=True, eq=False)
class Found:
    """Where a search ended: the point, Q and its expansion there, and whether it is a minimum."""

    problem: Problem
    point: Point
    normal: Normal
    converged: bool
    iterations: int


def step_of(matrix: FloatArray, gradient: FloatArray, damping: float = 0.0) -> FloatArray:
    """-(matrix + damping·diag)⁻¹·gradient (p,), scaled; directions without information stay."""
    scale = _scale(matrix)
    unit = matrix / np.outer(scale, scale)
    unit[np.diag_indices_from(unit)] += damping
    return np.asarray(-np.linalg.lstsq(unit, gradient / scale, rcond=1e-13)[0] / scale, dtype=float)


def _scale(matrix: FloatArray) -> FloatArray:
    """Root of the diagonal (p,); 1 where there is no information."""
    diagonal = np.diag(matrix)
    return np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))


def unchanged(problem: Problem, _: Point) -> Problem:
    """A Q that stays the same during the search."""
    return problem


@dataclass(eq=False)
class _Weighting:
    """Forms Q anew at every point until it is `settled`."""

    refresh: Refresh
    settled: bool
    likeliest: tuple[Problem, Point, Normal] | None = None
    deviance: float = np.inf
    worse: int = 0
    """Points since the likeliest."""

    def formed(self, problem: Problem, point: Point) -> tuple[Problem, Point, Normal | None]:
        """Q and its expansion for the point: at it, or at the likeliest where it has led away."""
        if self.settled:
            return problem, point, problem.normal(point)
        problem = self.refresh(problem, point)
        normal = problem.normal(point)
        if normal is None:
            return problem, point, None
        deviance = normal.cost + problem.log_determinant
        if self.likeliest is None or deviance < self.deviance:
            self.likeliest, self.deviance, self.worse = (problem, point, normal), deviance, 0
        else:
            self.worse += 1
        self.settled = self.worse == PATIENCE
        return self.likeliest if self.settled else (problem, point, normal)


def minimise(
    problem: Problem,
    start: Point,
    refresh: Refresh = unchanged,
    rough: bool = False,
    limit: float = np.inf,
) -> Found | None:
    """Search from `start`; None where the simulation fails there.

    `refresh` gives Q anew at every point until the minimum is close, for a weighting that follows.
    A `rough` search ends where Q hardly falls any more. Not converged after `MAX_STEPS`, or after
    `FAR_STEPS` with Q above `limit`, says so; the values are then no estimate.
    """
    point = start.moved(np.clip(start.values, problem.lower, problem.upper))
    damping, first = DAMPING, None
    weighting = _Weighting(refresh, settled=refresh is unchanged)
    most, crawled = ROUGH_STEPS if rough else MAX_STEPS, 0
    for iteration in range(most):
        problem, point, normal = weighting.formed(problem, point)
        if normal is None:
            return None
        expected = _expected(problem, point, normal)
        first = first or expected
        tell(_done(first, expected))
        weighting.settled |= iteration + 1 >= REFRESHES and expected < CLOSE
        settled = weighting.settled
        if expected < ENOUGH and settled:
            return Found(problem, point, normal, True, iteration)
        trial, fall, damping = _better(problem, point, normal, damping)
        if rough and trial is not None and fall < ROUGH * normal.cost:
            return Found(problem, trial, normal, True, iteration)
        crawls = fall < CRAWLING * expected
        crawled = crawled + 1 if crawls else 0
        weighting.settled |= crawled >= PATIENCE
        near = (settled and expected < CLOSE) or crawled >= PATIENCE
        if not rough and crawls and near:
            along, lower, expected = _along_kink(problem, point, normal)
            if along is not None and lower > fall:
                trial, fall = along, lower
        if trial is None or (fall < ENOUGH and expected < STALLED and settled):
            return Found(problem, point, normal, expected < STALLED, iteration)
        point = trial
        if iteration + 1 == FAR_STEPS and normal.cost > limit:
            break
    last = problem.normal(point)
    return None if last is None else Found(problem, point, last, False, iteration + 1)


def _along_kink(
    problem: Problem, point: Point, normal: Normal
) -> tuple[Point | None, float, float]:
    """A point with less Q along the kink that `point` lies at, by how much less, and the fall
    expected on the way.

    None where there is none: the sides that the steps reach are gathered until their least
    combination promises too little.
    """
    sides = [_Side(normal.gradient, 0.0)]
    while True:
        gradient, below = _least_of(sides, normal.information)
        least = replace(normal, gradient=gradient)
        expected = _expected(problem, point, least) + below
        if expected < ENOUGH or len(sides) == SIDES:
            return None, 0.0, expected
        step = _step(problem, point, least, 0.0)
        for share in 0.5 ** np.arange(HALVINGS):
            values = np.clip(point.values + share * step, problem.lower, problem.upper)
            trial = point.moved(values)
            fall = normal.cost - problem.cost(trial)
            if fall > CRAWLING * share * expected:
                return trial, fall, expected
        behind = problem.normal(trial)
        if behind is None:
            return None, 0.0, expected
        sides.append(_Side.seen(behind, normal, trial.values - point.values))


@dataclass(frozen=True, eq=False)
class _Side:
    """One of the smooth pieces that meet at a kink, continued to the point of the search: its
    gradient (p,) there, and by how much it lies `below` Q."""

    gradient: FloatArray
    below: float

    @classmethod
    def seen(cls, there: Normal, here: Normal, way: FloatArray) -> _Side:
        """The side on which Q was expanded `way` (p,) from here."""
        curved = here.information @ way
        continued = there.cost - 2.0 * there.gradient @ way + way @ curved
        return cls(there.gradient - curved, max(here.cost - float(continued), 0.0))


def _least_of(sides: list[_Side], information: FloatArray) -> tuple[FloatArray, float]:
    """The convex combination of sides that promises the least fall: gradient (p,), how far below.

    The dual of the least of all sides' highest: min ‖Σ a·g‖² + Σ a·below over the simplex, in the
    measure of the information's inverse.
    """
    scale = _scale(information)
    gradients = np.array([side.gradient for side in sides])
    below = np.array([side.below for side in sides])
    inverse = np.linalg.pinv(information / np.outer(scale, scale), rcond=1e-13, hermitian=True)
    square = (gradients / scale) @ inverse @ (gradients / scale).T
    unit = max(float(square.max() + below.max()), 1e-300)

    def fall(share: FloatArray) -> float:
        return float(share @ square @ share + below @ share) / unit

    def slope(share: FloatArray) -> FloatArray:
        return np.asarray((2.0 * square @ share + below) / unit)

    found = minimize(
        fall,
        np.full(len(sides), 1.0 / len(sides)),
        jac=slope,
        bounds=Bounds(0.0, 1.0),
        constraints=LinearConstraint(np.ones((1, len(sides))), 1.0, 1.0),
        method="SLSQP",
        options={"ftol": 1e-12},
    )
    return np.asarray(found.x @ gradients), float(found.x @ below)


def _done(first: float, expected: float) -> float:
    """Share of the way, in powers of ten, from the first expected fall of Q to `ENOUGH`."""
    if min(first, expected) <= ENOUGH:
        return 1.0
    return float(np.log(first / expected) / np.log(first / ENOUGH))


def _better(
    problem: Problem, point: Point, normal: Normal, damping: float
) -> tuple[Point | None, float, float]:
    """A point with less Q, by how much less, and the next damping, raised until there is one."""
    while damping < LARGEST:
        values = ahead(point, _step(problem, point, normal, damping))
        trial = point.moved(np.clip(values, problem.lower, problem.upper))
        fall = normal.cost - problem.cost(trial)
        if fall > 0.0:
            return trial, fall, damping / 10.0
        damping *= 10.0
    return None, 0.0, damping


def _step(problem: Problem, point: Point, normal: Normal, damping: float) -> FloatArray:
    """Step (p,) to the least expanded Q within the bounds.

    Cut at a bound one unknown would undo what those that nearly compensate it gain, so the bounds
    are part of the least-squares problem (Stark and Parker 1995).
    """
    room = np.array([problem.lower, problem.upper]) - point.values
    step = step_of(normal.information, normal.gradient, damping)
    if np.all((step >= room[0]) & (step <= room[1])):
        return step
    scale = _scale(normal.information)
    unit = normal.information / np.outer(scale, scale)
    power, directions = np.linalg.eigh(unit + damping * np.eye(scale.size))
    root = np.sqrt(np.maximum(power, 1e-13 * power[-1]))
    target = -(directions.T @ (normal.gradient / scale)) / root
    bounds = (room[0] * scale, room[1] * scale)
    found = lsq_linear(root[:, None] * directions.T, target, bounds, method="bvls")
    return np.asarray(np.clip(found.x / scale, *room))


def _expected(problem: Problem, point: Point, normal: Normal) -> float:
    """Fall of Q that a full step within the bounds promises."""
    step = _step(problem, point, normal, 0.0)
    return -float(2.0 * step @ normal.gradient + step @ normal.information @ step)
