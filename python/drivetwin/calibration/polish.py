# SPDX-License-Identifier: MIT
"""Search for policy values: global hops, local polish, and repair of exceeded limits.

The search goes by short polishes on few draws, from points of the whole ranges and about the start
and from hops of a pool of the best, then by hops on more draws. A polish is sequential linear
programming with a trust region: in each step peak jerk and limits are linear in the coordinates, by
forward differences over the scenarios near their tails. The linear program minimises the tail mean
of peak jerk in its epigraph form and the excess over limits.

Sources: D. Wales and J. Doye, Global optimization by basin-hopping, J. Phys. Chem. A 101 (1997);
J. Nocedal and S. J. Wright, Numerical Optimization, section 18.5 (Sℓ1LP); R. T. Rockafellar and S.
Uryasev, Journal of Risk 2 (2000), for the tail mean.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.sparse import csr_array, hstack

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import spell_unit
from drivetwin._util.progress import notify_progress
from drivetwin.calibration.certificate import LimitCheck
from drivetwin.calibration.metrics import METRICS, Metric, Outcome
from drivetwin.calibration.objective import Objective, Statistic
from drivetwin.errors import InfeasibleError

_POOL = 6
"""Minima from which hops start."""
_CLOSE = 0.02
"""Largest distance of coordinates at which two minima count as one."""
_RANK = 1.2
"""Scale of the exponential law by which a hop chooses the rank of its minimum."""
_PARTIAL, _PARTIAL_STEP = 0.3, 2.5
"""Share of the coordinates that a partial hop moves, and its step over that of a full one."""
_CROSS_STEP = 0.3
"""Step of a hop towards other coordinates, over that of a full one."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """Coordinates (q,) and their objective."""

    coordinates: FloatArray
    value: float


def search_minima(
    improve: Callable[[FloatArray], Candidate],
    starts: Sequence[FloatArray],
    hops: int,
    step: float,
    random: np.random.Generator,
) -> list[Candidate]:
    """Return the pool of minima, best first, from `starts` (q,) and then from hops of the pool.

    `improve` polishes coordinates (q,) and returns them with their objective; `step` is that of a
    hop, in shares of the ranges.
    """
    total, pool = len(starts) + hops, list[Candidate]()
    for number in range(total):
        notify_progress(number / total)
        at = starts[number] if number < len(starts) else _hop(pool, step, random)
        found = improve(np.clip(at, 0.0, 1.0))
        near = [one for one in pool if np.abs(one.coordinates - found.coordinates).max() < _CLOSE]
        if all(found.value < one.value for one in near):
            others = (one for one in pool if one not in near)
            pool = sorted([*others, found], key=lambda one: one.value)[:_POOL]
    return pool


def _hop(pool: list[Candidate], step: float, random: np.random.Generator) -> FloatArray:
    """Move from a minimum of the pool: all coordinates, some, or towards other coordinates.

    These are another minimum, or the same with each coordinate in place of its neighbour: the next
    minimum of a profile is often the same profile one knot earlier or later.
    """
    at = pool[min(int(random.exponential(_RANK)), len(pool) - 1)].coordinates
    noise, kind = random.standard_normal(at.size), random.integers(4)
    if kind == 0:
        return at + step * noise
    if kind == 1:
        return at + _PARTIAL_STEP * step * noise * (random.random(at.size) < _PARTIAL)
    shifted = np.arange(at.size) + random.choice((-1, 1))
    other: FloatArray = at[shifted.clip(0, at.size - 1)]
    if kind == 2:
        other = pool[int(random.integers(len(pool)))].coordinates
    return at + random.uniform(-0.3, 1.3) * (other - at) + _CROSS_STEP * step * noise


Run = Callable[[Sequence[FloatArray], NDArray[np.intp] | None], list[Outcome]]
"""Outcomes of candidates, coordinates (q,), over the scenarios of some places; None takes all."""

_REACH = 2
"""Scenarios whose jerk is linearised, over the number in the tail; the others stay below it."""

_DIFFERENCE = 2e-5
"""Step of the differences, in shares of the ranges.

The simulation is exact and piecewise smooth. A longer step passes changes in the order of events,
where the slope has no meaning; a shorter one comes near the tolerance of the solver.
"""
_PEAKS = 8
"""Local maxima of |jerk| per scenario that enter a linear program."""
_STEEPEST = 5e4
"""Slope of jerk [m/s^3 per range] beyond which a difference straddles an event."""
_FIRST_RADIUS, _LEAST_RADIUS, _LARGEST_RADIUS = 0.03, 2e-4, 0.25
"""Trust region in shares of the ranges."""
_RADII = (1.0, 0.3, 0.1)
"""Shares of the trust region in which the linear program is solved and its step tried."""
_GROWTH, _KEPT, _SHRINK = 2.0, 1.5, 0.05
"""Factors on the radius: after the largest step, on the radius of a smaller one, after none."""
_VIOLATED = 1e-6
"""Excess of a row over its bound, relative to the least cost, below which the row holds."""
_STALL = 2e-3
"""Relative gain below which an iteration counts as none."""
_STALLS = 4
"""Iterations without gain after which the polish ends."""


@dataclass(frozen=True, eq=False)
class Linear:
    """Rows of a linear program: `value` (r,) and `slope` (r, q) of what scenario `owner` has."""

    value: FloatArray
    slope: FloatArray
    owner: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Program:
    """Linear program at coordinates `at` (q,): cost, matrix and bounds of its rows.

    The first rows are those of jerk, each of a scenario in `owner` (r,); few of them bind.
    """

    at: FloatArray
    cost: FloatArray
    matrix: Any  # A csr_array; the types of `linprog` lack the sparse arrays that it takes.
    bound: FloatArray
    owner: NDArray[np.intp]

    def solve(self, radius: float) -> FloatArray:
        """Return the best coordinates (q,) within a radius; `at` where there is no solution.

        Rows of jerk join where a solution violates them, the most violated one of each scenario,
        so that the last solution is that of all rows. Source: J. E. Kelley, The cutting-plane
        method for solving convex programs, J. SIAM 8 (1960).
        """
        at, rows = self.at, self.owner.size
        box = zip(np.maximum(-radius, -at), np.minimum(radius, 1.0 - at), strict=True)
        bounds = [*box, (None, None), *[(0.0, None)] * (self.cost.size - at.size - 1)]
        kept = np.arange(self.bound.size) >= rows
        kept[_choose_largest(-self.bound[:rows], self.owner)] = True
        while True:
            solved = linprog(
                self.cost,
                A_ub=self.matrix[kept],
                b_ub=self.bound[kept],
                bounds=bounds,
                method="highs",
            )
            if solved.x is None:
                return at
            excess = np.where(kept, 0.0, self.matrix @ solved.x - self.bound)[:rows]
            worst = _choose_largest(excess, self.owner)
            joining = worst[excess[worst] > _VIOLATED * abs(float(self.cost @ solved.x))]
            if joining.size == 0:
                return np.asarray(np.clip(at + solved.x[: at.size], 0.0, 1.0))
            kept[joining] = True


def _choose_largest(values: FloatArray, owner: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return the place of the largest of `values` (r,) of each owner (r,)."""
    order = np.lexsort((values, owner))
    last = np.searchsorted(owner[order], np.unique(owner), side="right") - 1
    return np.asarray(order[last])


def polish(run: Run, start: FloatArray, objective: Objective, iterations: int) -> Candidate:
    """Improve coordinates (q,) from `start` by at most `iterations` linear programs.

    Each is solved in trust regions of several radii, so that one linearisation serves them all.
    """
    at, outcome = start, run([start], None)[0]
    best, radius, stalls = objective.evaluate(outcome), _FIRST_RADIUS, 0
    program = None
    for iteration in range(iterations):
        notify_progress(iteration / iterations)
        program = program or _build_program(run, at, outcome, objective)
        tried = [program.solve(share * radius) for share in _RADII]
        outcomes = run(tried, None)
        values = [objective.evaluate(one) for one in outcomes]
        chosen = int(np.argmin(values))
        gain = best - values[chosen]
        if gain > 0.0:
            at, outcome, best, program = tried[chosen], outcomes[chosen], values[chosen], None
        radius = _change_radius(radius, chosen if gain > 0.0 else None)
        stalls = stalls + 1 if gain < _STALL * best else 0
        if stalls == _STALLS or radius < _LEAST_RADIUS:
            break
    notify_progress(1.0)
    return Candidate(at, best)


def _change_radius(radius: float, chosen: int | None) -> float:
    """Return the radius after the step of place `chosen` in the radii; None without a gain."""
    if chosen is None:
        return _SHRINK * radius
    return min((_KEPT if chosen else _GROWTH) * _RADII[chosen] * radius, _LARGEST_RADIUS)


def _build_program(run: Run, at: FloatArray, outcome: Outcome, objective: Objective) -> Program:
    """Linearise jerk and limits at coordinates (q,), over the scenarios near the tails."""
    signs = np.where(at < 0.5, 1.0, -1.0)
    near = _choose_near_tails(outcome, objective)
    moved = run([at + _DIFFERENCE * step for step in np.diag(signs)], near)
    width = _DIFFERENCE * signs
    jerk = _linearise_jerk(outcome.select(near), moved, width)
    limits = []
    for one in objective.limits:
        base, slope = _compute_slope(one.measure, outcome.select(near), moved, width)
        if one.statistic is Statistic.MEAN:  # that of all scenarios, with the slope of some
            base = one.measure(outcome)
        limits.append(Linear(base, slope, np.arange(base.size)))
    return assemble_program(at, objective, jerk, limits, outcome.jerk.shape[0])


def _choose_near_tails(outcome: Outcome, objective: Objective) -> NDArray[np.intp]:
    """Return the places (n,) of the scenarios that a step may bring into a tail."""
    tail = max(1, round((1.0 - objective.share) * outcome.jerk.shape[0]))
    sizes = {one.metric: tail for one in objective.limits if one.statistic is Statistic.SHARE_95}
    sizes[Metric.PEAK_JERK] = _REACH * tail
    return np.unique(
        np.concatenate([np.argsort(outcome.values[one])[-size:] for one, size in sizes.items()])
    )


def _linearise_jerk(outcome: Outcome, moved: list[Outcome], width: FloatArray) -> Linear:
    """Linearise the largest local maxima of |jerk|.

    Samples beside them are left out: where an event moves past a sample, its slope only hinders.
    """
    size = np.abs(outcome.jerk)
    inner = size[:, 1:-1]
    owner, place = np.nonzero((inner >= size[:, :-2]) & (inner >= size[:, 2:]))
    order = np.lexsort((-inner[owner, place], owner))
    owner, place = owner[order], 1 + place[order]
    rank = np.arange(owner.size) - np.searchsorted(owner, owner)
    owner, place = owner[rank < _PEAKS], place[rank < _PEAKS]

    def measure(one: Outcome) -> FloatArray:
        return np.asarray(np.abs(one.jerk[owner, place]))

    base, slope = _compute_slope(measure, outcome, moved, width)
    kept = np.abs(slope).max(axis=1) < _STEEPEST
    return Linear(base[kept], slope[kept], owner[kept])


def _compute_slope(
    measure: Callable[[Outcome], FloatArray],
    outcome: Outcome,
    moved: list[Outcome],
    width: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Measure an outcome (r,), and its slopes (r, q) by moves of `width` (q,)."""
    base = measure(outcome)
    steps = [(measure(one) - base) / h for one, h in zip(moved, width, strict=True)]
    return base, np.stack(steps, axis=1)


def assemble_program(
    at: FloatArray, objective: Objective, jerk: Linear, limits: list[Linear], scenarios: int
) -> Program:
    """Assemble the program over step (q,), threshold, excess over it (runs,), and the limits'.

    The rows are those of the scenarios near the tails; `scenarios` is the number of all.
    The tail mean is the threshold plus the mean excess over it divided by 1 - share.
    """
    counts = [one.value.size for one in limits]
    near = 1 + max(jerk.owner.tolist(), default=-1)
    tail = 1.0 / ((1.0 - objective.share) * scenarios)
    means = [one.statistic is Statistic.MEAN for one in objective.limits]
    excess = [np.full(count, objective.weight / (1 if mean else scenarios))
              for count, mean in zip(counts, means, strict=True)]  # fmt: skip
    cost = np.concatenate([np.zeros(at.size), [1.0], np.full(near, tail), *excess])
    value = np.concatenate([jerk.value, *(one.value for one in limits)])
    slope = np.concatenate([jerk.slope, *(one.slope for one in limits)])
    threshold = np.where(np.arange(value.size) < jerk.value.size, -1.0, 0.0)
    own = np.concatenate([jerk.owner, near + np.arange(sum(counts))])
    slack = csr_array(
        (np.full(value.size, -1.0), (np.arange(value.size), own)),
        shape=(value.size, near + sum(counts)),
    )
    matrix = hstack([csr_array(slope), csr_array(threshold[:, None]), slack], format="csr")
    return Program(at, cost, matrix, -value, jerk.owner)


TOLERANCE = 0.01
"""Relative excess over a limit from which the limit counts as out of reach."""


def keep_limits(
    measure: Callable[[FloatArray], list[float]],
    improve: Callable[[FloatArray, Objective], FloatArray],
    start: FloatArray,
    objective: Objective,
    rounds: int,
    factor: float,
) -> Candidate:
    """Polish under tighter limits until all are kept.

    The polish sees few draws, and its penalty is soft: where comfort gains more by an excess than
    the excess costs, the limit is exceeded.

    Parameters
    ----------
    measure
        Relative excess of coordinates (q,) over each limit, on draws of their own.
    improve
        Coordinates (q,) after a polish.
    start
        Coordinates (q,).
    objective
        Objective of the first polish.
    rounds
        Largest number of polishes, each with bounds lower by the excess before it.
    factor
        Factor on the weight of the excess from one polish to the next.

    Returns
    -------
    Candidate
        The first coordinates that keep all limits, or those with the least excess, and that excess.
    """
    at, tried = start, []
    for number in range(rounds + 1):
        excesses = measure(at)
        tried.append(Candidate(at, max(excesses, default=0.0)))
        if tried[-1].value <= 0.0 or number == rounds:
            break
        beyond = [max(one, 0.0) for one in excesses]
        tighter = objective.tighten([one / (1.0 + one) for one in beyond])
        objective = replace(tighter, weight=factor * tighter.weight)
        at = improve(at, objective)
    return min(tried, key=lambda one: max(one.value, 0.0))


def require_limits(found: Sequence[LimitCheck], start: Sequence[LimitCheck]) -> None:
    """Raise InfeasibleError where a limit is exceeded by more than 1 %, by its estimate.

    `found` are the limits on fresh draws of a calibration, `start` those of its start.
    """
    pairs = zip(found, start, strict=True)
    exceeded = [(one, old) for one, old in pairs if one.value > (1.0 + TOLERANCE) * one.limit.bound]
    if exceeded:
        raise InfeasibleError(
            f"no calibration within the {len(found)} limits was found; the best exceeds "
            + "; ".join(_describe_excess(*one) for one in exceeded),
            f"raise {' and '.join(_describe_remedy(one) for one, _ in exceeded)}, relax another "
            "limit that works against it, or search longer (--effort)",
        )


def _describe_excess(one: LimitCheck, start: LimitCheck) -> str:
    spec, bound = METRICS[one.limit.metric], one.limit.bound
    unit = spell_unit(spec.unit)
    return (
        f"{spec.label} ({one.limit.statistic}) {one.value:.4g} {unit}, limit {bound:.4g}: "
        f"{one.value - bound:.2g} {unit} or {100.0 * (one.value / bound - 1.0):.1f} % "
        f"above it (start: {start.value:.4g} {unit})"
    )


def _describe_remedy(one: LimitCheck) -> str:
    spec = METRICS[one.limit.metric]
    value = one.value if one.upper is None else one.upper
    return f"the limit of the {spec.label} to {value:.3g} {spell_unit(spec.unit)}"
