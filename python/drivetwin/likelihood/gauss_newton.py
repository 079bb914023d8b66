# SPDX-License-Identifier: MIT
"""Gauss-Newton minimisers of an `Objective`: damped, with line search, and constrained.

`minimise` is the damped method (Levenberg 1944, Marquardt 1963) on the information matrix. The
parameters differ by ten orders of magnitude in size, so every matrix is scaled to a unit diagonal
before it is solved. The search ends when a full step would lower Q by less than `ftol`, which is
the same share of a squared standard deviation for every parameter.

Q may have kinks. In a driveline, pressure noise about P0 fills and vents an element many times,
and a parameter that moves such an instant over a sample bends Q. Plain steps crawl along a kink.
There the gradient is replaced by the convex combination of the gradients on both sides that
predicts the smallest decrease (Lemaréchal 1975).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Generic, TypeVar

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.progress import notify_progress
from drivetwin.likelihood.point import (
    CurvedObjective,
    NormalEquations,
    Objective,
    ParameterVector,
)

RCOND = 1e-13
"""Relative singular value below which a direction carries no information [-]."""


@dataclass(frozen=True)
class GaussNewtonSettings:
    """Settings of the damped Gauss-Newton search; decreases are of Q over its excess [-]."""

    ftol: float = 1e-2
    """Predicted decrease at which the search ends: 0.1 standard deviations [-]."""
    kink_ftol: float = 0.3
    """Predicted decrease below which a point that no step improves is accepted as a minimum: at a
    kink the expansion predicts a decrease that no step attains [-]."""
    crawl_ratio: float = 0.1
    """Ratio of actual to predicted decrease below which a step has met a kink [-]."""
    max_subgradients: int = 8
    """Largest number of gradients about a kink that are combined [-]."""
    max_halvings: int = 6
    """Number of step lengths tried across a kink before the other side counts as reached [-]."""
    initial_damping: float = 1e-3
    """Initial damping relative to the diagonal of the information [-]."""
    max_damping: float = 1e8
    """Damping at which the search for a lower point ends [-]."""
    max_iter: int = 40
    """Largest number of iterations [-]."""
    rough_max_iter: int = 20
    """Largest number of iterations of a rough search [-]."""
    screening_iter: int = 8
    """Iterations after which a search with Q above its limit ends: searches that start far off and
    succeed have converged by then [-]."""
    bend_ratio: float = 0.75
    """Ratio of actual to predicted decrease below which a step is bent along the valley, as those
    of the coefficients of a friction law and of inertias on both sides of a shaft; 0 for never
    [-]."""
    min_refreshes: int = 3
    """Smallest number of points at which the weighting is recomputed [-]."""
    patience: int = 3
    """Number of successive points without an increase of the likelihood (Q + log|Σ|) after which
    the weighting is frozen at the likeliest point, and of crawling steps after which a kink is
    assumed: a weighting that follows the point may lead away, because a larger input noise leaves
    smaller residuals [-]."""
    local_decrease: float = 10.0
    """Predicted decrease below which the weighting is frozen, because it may alternate about a
    kink, and below which the search looks along kinks: from further off the other side of a kink is
    not known [-]."""
    rough_rtol: float = 1e-3
    """Decrease relative to Q at which a rough search ends [-]."""

    def scale(self, unit: float) -> GaussNewtonSettings:
        """Return the settings with all decreases times `unit`."""
        return replace(
            self,
            ftol=unit * self.ftol,
            kink_ftol=unit * self.kink_ftol,
            local_decrease=unit * self.local_decrease,
        )


@dataclass(frozen=True)
class LineSearchSettings:
    """Settings of the Gauss-Newton search with step halving."""

    max_iter: int = 20
    """Largest number of iterations [-]."""
    max_halvings: int = 8
    """Largest number of step lengths per iteration [-]."""
    rtol: float = 1e-9
    """Increase relative to Q that still counts as no increase [-]."""


@dataclass(frozen=True)
class ConstrainedSettings:
    """Settings of the equality-constrained Gauss-Newton search."""

    ftol: float = 1e-2
    """Decrease of Q at which the search ends [-]."""
    max_iter: int = 8
    """Largest number of iterations [-]."""


GAUSS_NEWTON = GaussNewtonSettings()
LINE_SEARCH = LineSearchSettings()
CONSTRAINED = ConstrainedSettings()
_PROBE = 0.1
"""Share of a step after which the curvature of the model is measured [ratio]."""
_MAX_BEND = 0.75
"""Largest geodesic acceleration over the step that it bends [ratio]."""
_USUAL_ITERATIONS = 10
"""Iterations of a search from a rough start; only the progress shown depends on them."""

P = TypeVar("P", bound=Objective)
C = TypeVar("C", bound=CurvedObjective)


@dataclass(frozen=True, eq=False)
class OptimizeResult(Generic[P]):
    """Result of a search: final objective and point, expansion of Q there, convergence flag."""

    problem: P
    point: ParameterVector
    normal: NormalEquations
    converged: bool
    iterations: int


def solve_step(matrix: FloatArray, gradient: FloatArray, damping: float = 0.0) -> FloatArray:
    """Compute -(matrix + damping·diag)⁻¹·gradient (p,), scaled to a unit diagonal.

    Directions without information are not moved.
    """
    scale = _compute_scale(matrix)
    unit = matrix / np.outer(scale, scale)
    unit[np.diag_indices_from(unit)] += damping
    return np.asarray(-np.linalg.lstsq(unit, gradient / scale, rcond=RCOND)[0] / scale, dtype=float)


def _compute_scale(matrix: FloatArray) -> FloatArray:
    """Compute the root of the diagonal (p,); 1 for parameters without information."""
    diagonal = np.diag(matrix)
    return np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))


@dataclass(eq=False)
class _Weighting(Generic[P]):
    """Iteratively reweighted objective: recomputed at every point until `is_frozen`."""

    refresh: Callable[[P, ParameterVector], P] | None
    patience: int
    best: tuple[P, ParameterVector, NormalEquations] | None = None
    deviance: float = np.inf
    worse: int = 0
    """Number of points since the likeliest."""

    def __post_init__(self) -> None:
        """Freeze a weighting that never changes."""
        self.is_frozen = self.refresh is None

    def reweight(
        self, problem: P, point: ParameterVector
    ) -> tuple[P, ParameterVector, NormalEquations | None]:
        """Reweight the objective at `point`; return the likeliest one once it has led away."""
        if self.is_frozen or self.refresh is None:
            return problem, point, problem.normal(point)
        problem = self.refresh(problem, point)
        normal = problem.normal(point)
        if normal is None:
            return problem, point, None
        deviance = normal.cost + problem.log_determinant
        if self.best is None or deviance < self.deviance:
            self.best, self.deviance, self.worse = (problem, point, normal), deviance, 0
        else:
            self.worse += 1
        self.is_frozen = self.worse == self.patience
        return self.best if self.is_frozen else (problem, point, normal)


def minimise(
    problem: C,
    start: ParameterVector,
    refresh: Callable[[C, ParameterVector], C] | None = None,
    rough: bool = False,
    limit: float = np.inf,
    settings: GaussNewtonSettings = GAUSS_NEWTON,
) -> OptimizeResult[C] | None:
    """Minimise Q from `start`; return None if the model cannot be evaluated there.

    `refresh` recomputes Q at every point until the minimum is close (iterative reweighting).
    A `rough` search ends when Q hardly decreases. The result is not converged after
    `max_iter` iterations, or after `screening_iter` iterations with Q above `limit`; its values
    are then no estimate.
    """
    point = start.replace_values(np.clip(start.values, problem.lower, problem.upper))
    damping, first, usual = settings.initial_damping, None, settings
    weighting = _Weighting(refresh, settings.patience)
    max_iter, crawls = settings.rough_max_iter if rough else settings.max_iter, 0
    for iteration in range(max_iter):
        problem, point, normal = weighting.reweight(problem, point)
        if normal is None:
            return None
        settings = usual.scale(normal.excess)
        expected = predict_decrease(problem, point, normal.information, normal.gradient)
        first = first or expected
        notify_progress(_estimate_progress(first, expected, settings.ftol, iteration))
        is_local = expected < settings.local_decrease
        weighting.is_frozen |= iteration + 1 >= settings.min_refreshes and is_local
        frozen = weighting.is_frozen
        if expected < settings.ftol and frozen:
            return OptimizeResult(problem, point, normal, True, iteration)
        trial, fall, damping = _take_damped_step(problem, point, normal, damping, settings)
        if rough and trial is not None and fall < settings.rough_rtol * normal.cost:
            return OptimizeResult(problem, trial, normal, True, iteration)
        is_crawling = fall < settings.crawl_ratio * expected
        crawls = crawls + 1 if is_crawling else 0
        weighting.is_frozen |= crawls >= settings.patience
        search_kink = (frozen and is_local) or crawls >= settings.patience
        if not rough and is_crawling and search_kink:
            along, lower, expected = _take_bundle_step(problem, point, normal, settings)
            if along is not None and lower > fall:
                trial, fall = along, lower
        if trial is None or (fall < settings.ftol and expected < settings.kink_ftol and frozen):
            return OptimizeResult(problem, point, normal, expected < settings.kink_ftol, iteration)
        point = trial
        if iteration + 1 == settings.screening_iter and normal.cost > limit:
            break
    last = problem.normal(point)
    return None if last is None else OptimizeResult(problem, point, last, False, iteration + 1)


def minimise_with_line_search(
    problem: P,
    start: ParameterVector,
    solve: Callable[[FloatArray, FloatArray], FloatArray],
    tolerance: float,
    settings: LineSearchSettings = LINE_SEARCH,
) -> OptimizeResult[P]:
    """Minimise a smooth Q from `start` by Gauss-Newton; stop at `tolerance` standard errors.

    `solve` computes information⁻¹·gradient (p,). A step that raises Q is halved. If no halving
    helps, the search ends at the point before it; that result is not converged.
    """
    point, normal = start, problem.normal(start)
    for iteration in range(settings.max_iter):
        assert normal is not None
        step = -solve(normal.information, normal.gradient)
        for _ in range(settings.max_halvings):
            trial = point.replace_values(point.values + step)
            if problem.cost(trial) <= normal.cost * (1.0 + settings.rtol):
                break
            step = 0.5 * step
        else:
            return OptimizeResult(problem, point, normal, False, iteration)
        length = float(np.sqrt(step @ normal.information @ step))
        point, normal = trial, problem.normal(trial)
        assert normal is not None
        if length < tolerance:
            return OptimizeResult(problem, point, normal, True, iteration + 1)
    assert normal is not None
    return OptimizeResult(problem, point, normal, False, settings.max_iter)


def minimise_constrained(
    problem: Objective,
    start: ParameterVector,
    miss: Callable[[ParameterVector], float],
    slope: Callable[[ParameterVector], FloatArray],
    tolerance: float,
    settings: ConstrainedSettings = CONSTRAINED,
) -> tuple[ParameterVector, float] | None:
    """Minimise Q under an equality constraint g(θ) = g₀: the point and Q there.

    `miss` computes g₀ - g(θ), at most `tolerance` at the result, and `slope` the derivative (p,) of
    g. Each step is the Gauss-Newton step with a Lagrange multiplier, clipped at the bounds. Returns
    None if the model cannot be evaluated.
    """
    point, cost = start, float("inf")
    for _ in range(settings.max_iter):
        normal = problem.normal(point)
        if normal is None:
            return None
        is_met = abs(miss(point)) < tolerance
        if cost - normal.cost < settings.ftol and is_met:
            return point, normal.cost
        cost = normal.cost
        step = _solve_constrained(normal, slope(point), miss(point))
        point = point.replace_values(np.clip(point.values + step, problem.lower, problem.upper))
    return point, problem.cost(point)


def _solve_constrained(normal: NormalEquations, slope: FloatArray, miss: float) -> FloatArray:
    """Compute the Gauss-Newton step (p,) that changes the constrained function by `miss`."""
    scale = np.sqrt(np.maximum(np.diag(normal.information), 1e-300))
    unit = normal.information / np.outer(scale, scale)
    free = np.linalg.lstsq(unit, -normal.gradient / scale, rcond=RCOND)[0]
    along = np.linalg.lstsq(unit, slope / scale, rcond=RCOND)[0]
    short = miss - float(slope / scale @ free)
    return np.asarray((free + along * (short / float(slope / scale @ along))) / scale)


def _take_damped_step(
    problem: CurvedObjective,
    point: ParameterVector,
    normal: NormalEquations,
    damping: float,
    settings: GaussNewtonSettings,
) -> tuple[ParameterVector | None, float, float]:
    """Raise the damping until Q decreases: the point, the decrease and the next damping."""
    while damping < settings.max_damping:
        step = _solve_bounded(problem, point, normal.information, normal.gradient, damping)
        trial, fall = _try_step(problem, point, normal, step)
        if settings.bend_ratio > 0.0:
            expected = -float(2.0 * step @ normal.gradient + step @ normal.information @ step)
            if fall < settings.bend_ratio * expected:
                bent = _bend_step(problem, point, normal, step, damping)
                if bent is not None:
                    other, lower = _try_step(problem, point, normal, bent)
                    if lower > fall:
                        trial, fall = other, lower
        if fall > 0.0:
            return trial, fall, damping / 10.0
        damping *= 10.0
    return None, 0.0, damping


def _try_step(
    problem: Objective, point: ParameterVector, normal: NormalEquations, step: FloatArray
) -> tuple[ParameterVector, float]:
    """Compute the point after a step (p,), and the decrease of Q there."""
    values = problem.retract(point, step)
    trial = point.replace_values(np.clip(values, problem.lower, problem.upper))
    return trial, normal.cost - problem.cost(trial)


def _bend_step(
    problem: CurvedObjective,
    point: ParameterVector,
    normal: NormalEquations,
    step: FloatArray,
    damping: float,
) -> FloatArray | None:
    """Bend a step (p,) along a curved valley of Q: add its geodesic acceleration.

    None where the model cannot be evaluated on the way, or bends by more than the step is long
    (Transtrum and Sethna 2012).
    """
    curvature = problem.compute_curvature(point, normal, step, _PROBE)
    if curvature is None:
        return None
    bend = 0.5 * solve_step(normal.information, curvature, damping)
    scale = _compute_scale(normal.information)
    if np.linalg.norm(scale * bend) > _MAX_BEND * np.linalg.norm(scale * step):
        return None
    return np.asarray(step + bend)


def _take_bundle_step(
    problem: Objective,
    point: ParameterVector,
    normal: NormalEquations,
    settings: GaussNewtonSettings,
) -> tuple[ParameterVector | None, float, float]:
    """Find a lower point along the kink at `point`: it, the decrease and the predicted decrease.

    Collects subgradients until their convex combination predicts a decrease below `ftol`, or their
    number is at its limit; the point is then None.
    """
    pieces = [_Subgradient(normal.gradient, 0.0)]
    while True:
        gradient, below = _combine_subgradients(pieces, normal.information)
        expected = predict_decrease(problem, point, normal.information, gradient) + below
        if expected < settings.ftol or len(pieces) == settings.max_subgradients:
            return None, 0.0, expected
        step = _solve_bounded(problem, point, normal.information, gradient, 0.0)
        for share in 0.5 ** np.arange(settings.max_halvings):
            values = np.clip(point.values + share * step, problem.lower, problem.upper)
            trial = point.replace_values(values)
            fall = normal.cost - problem.cost(trial)
            if fall > settings.crawl_ratio * share * expected:
                return trial, fall, expected
        behind = problem.normal(trial)
        if behind is None:
            return None, 0.0, expected
        pieces.append(_Subgradient.from_expansion(behind, normal, trial.values - point.values))


@dataclass(frozen=True, eq=False)
class _Subgradient:
    """Smooth piece of Q continued to the current point: its gradient (p,) there, and its distance
    `below` Q."""

    gradient: FloatArray
    below: float

    @classmethod
    def from_expansion(
        cls, there: NormalEquations, here: NormalEquations, step: FloatArray
    ) -> _Subgradient:
        """Continue the expansion `there`, a `step` (p,) away, back to the current point."""
        curved = here.information @ step
        continued = there.cost - 2.0 * there.gradient @ step + step @ curved
        return cls(there.gradient - curved, max(here.cost - float(continued), 0.0))


def _combine_subgradients(
    pieces: list[_Subgradient], information: FloatArray
) -> tuple[FloatArray, float]:
    """Find the convex combination with the smallest predicted decrease: gradient (p,), distance.

    Solves the dual of the minimum of the upper envelope of all pieces: min ‖Σ a·g‖² + Σ a·below
    over the simplex, with the inverse information as metric.
    """
    from scipy.optimize import Bounds, LinearConstraint, minimize

    scale = _compute_scale(information)
    gradients = np.array([piece.gradient for piece in pieces])
    below = np.array([piece.below for piece in pieces])
    inverse = np.linalg.pinv(information / np.outer(scale, scale), rcond=RCOND, hermitian=True)
    square = (gradients / scale) @ inverse @ (gradients / scale).T
    unit = max(float(square.max() + below.max()), 1e-300)

    def fall(share: FloatArray) -> float:
        return float(share @ square @ share + below @ share) / unit

    def slope(share: FloatArray) -> FloatArray:
        return np.asarray((2.0 * square @ share + below) / unit)

    result = minimize(
        fall,
        np.full(len(pieces), 1.0 / len(pieces)),
        jac=slope,
        bounds=Bounds(0.0, 1.0),
        constraints=LinearConstraint(np.ones((1, len(pieces))), 1.0, 1.0),
        method="SLSQP",
        options={"ftol": 1e-12},
    )
    return np.asarray(result.x @ gradients), float(result.x @ below)


def _estimate_progress(first: float, expected: float, ftol: float, iteration: int) -> float:
    """Estimate the completed share of a search.

    Counts are the powers of ten of the predicted decrease. They may stand still for some iterations
    on the way to the minimum, so each iteration completes at least a part of the rest.
    """
    if min(first, expected) <= ftol:
        return 1.0
    least = 1.0 - (1.0 - 1.0 / _USUAL_ITERATIONS) ** iteration
    return max(least, float(np.log(first / expected) / np.log(first / ftol)))


def _solve_bounded(
    problem: Objective,
    point: ParameterVector,
    information: FloatArray,
    gradient: FloatArray,
    damping: float,
) -> FloatArray:
    """Compute the step (p,) to the minimum of the expanded Q within the bounds.

    If a step were clipped at a bound, one parameter would undo what correlated ones gain; so the
    bounds are part of the least-squares problem (Stark and Parker 1995).
    """
    room = np.array([problem.lower, problem.upper]) - point.values
    step = solve_step(information, gradient, damping)
    if np.all((step >= room[0]) & (step <= room[1])):
        return step
    from scipy.optimize import lsq_linear

    scale = _compute_scale(information)
    unit = information / np.outer(scale, scale)
    power, directions = np.linalg.eigh(unit + damping * np.eye(scale.size))
    root = np.sqrt(np.maximum(power, RCOND * power[-1]))
    target = -(directions.T @ (gradient / scale)) / root
    bounds = (room[0] * scale, room[1] * scale)
    result = lsq_linear(root[:, None] * directions.T, target, bounds, method="bvls")
    return np.asarray(np.clip(result.x / scale, *room))


def predict_decrease(
    problem: Objective, point: ParameterVector, information: FloatArray, gradient: FloatArray
) -> float:
    """Predict the decrease of Q by a full step within the bounds."""
    step = _solve_bounded(problem, point, information, gradient, 0.0)
    return -float(2.0 * step @ gradient + step @ information @ step)
