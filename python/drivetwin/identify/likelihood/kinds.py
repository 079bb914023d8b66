# SPDX-License-Identifier: MIT
"""What kind of signals a log holds: samples or means, an engine torque of lines or of curves.

An output may be the mean over the time since the sample before, as encoders on a bus send it. That
is half a sample late, and half a millisecond between torque and speed moves k_o and c_o by several
standard deviations. Between its samples an engine torque may be straight or a curve (`bend_of`).
Which kind fits better is told by the expansion of Q for one of them: what the others would show
differs by a known column each.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from drivetwin.identify.likelihood.fit import NEAR, LikelihoodFit, nearest
from drivetwin.identify.likelihood.newton import step_of
from drivetwin.identify.likelihood.problem import Normal, Part, Problem
from drivetwin.identify.likelihood.record import OUTPUTS, TORQUE, columns_of
from drivetwin.identify.likelihood.unknowns import Point
from drivetwin.identify.signals import FloatArray

SIGNALS = (*OUTPUTS, TORQUE)
SPEEDS = tuple(name for name in OUTPUTS if name.endswith("speed"))
GAIN = 4.0
"""Promised fall of Q from which on signals change their kind: two standard deviations."""
ROUNDS = 3
"""Most changes of kind: far off, the expansion promises the way, not the end of it."""


def likely_kinds(problem: Problem, start: Point) -> tuple[Problem, Problem]:
    """The problem, which has signals as read, with the kinds that promise least from `start`, and
    with the speeds of the other kind. From far off nothing is promised."""
    weighted = problem.weighted_by(start)
    normal = weighted.normal(start)
    if normal is None or normal.cost > NEAR * problem.size:
        kinds = frozenset[str]()
    else:
        kinds = _promising(weighted, start, normal)
    return problem.of_kinds(kinds), problem.of_kinds(kinds ^ frozenset(SPEEDS))


def with_kinds(problem: Problem, best: LikelihoodFit) -> LikelihoodFit:
    """The fit with every signal of the kind that leaves less.

    `problem` has signals as read, `best` is its fit with some kinds. Without an output torque half
    a period of all speeds is an age of the engine torque, too far away for an expansion to tell
    which it is: there the other kind of speeds is tried.
    """

    def better_of(one: LikelihoodFit, kinds: frozenset[str]) -> LikelihoodFit:
        if kinds == one.problem.kinds:
            return one
        other = nearest(problem.of_kinds(kinds), one.point)
        return one if other is None or left(other) >= left(one) else other

    def left(one: LikelihoodFit) -> float:
        return one.chi2 * problem.size + GAIN * len(one.problem.kinds)

    for _ in range(ROUNDS):
        known, best = best, better_of(best, _promising(best.problem, best.point, best.normal))
        if best is known:
            break
    if problem.parts[0].scale_known:
        return best
    return better_of(best, best.problem.kinds ^ frozenset(SPEEDS))


def in_words(kinds: frozenset[str]) -> list[str]:
    """What is said of signals that are not as read."""
    means = ", ".join(name.replace("_", " ") for name in OUTPUTS if name in kinds)
    return [f"samples are means over their period, which fits better: {means}"] if means else []


def _promising(problem: Problem, point: Point, normal: Normal) -> frozenset[str]:
    """Names of the signals that are better taken for something else than read.

    `normal` is the expansion at `point`. With the residual r - B·s, where s picks columns of B, Q
    changes by sᵀBᵀΣ⁻¹B·s - 2·sᵀBᵀΣ⁻¹r before the parameters follow.
    """
    count = len(SIGNALS)
    through, square = np.zeros(count), np.zeros((count, count))
    pull = np.zeros((len(point.names), count))
    for part, residual, regressors in zip(
        problem.parts, normal.residuals, normal.regressors, strict=True
    ):
        change = _changes(part, point)
        weighted = part.weighting.weighted(change)
        through += weighted.T @ residual
        square += change.T @ weighted
        pull += regressors.T @ change

    def left(choice: tuple[int, ...]) -> float:
        s = np.array(choice, dtype=float)
        gradient = normal.gradient + pull @ s
        followed = gradient @ step_of(normal.information, gradient)
        return float(s @ square @ s - 2.0 * s @ through + followed) + GAIN * len(changed(choice))

    def changed(choice: tuple[int, ...]) -> frozenset[str]:
        return problem.kinds ^ {name for name, flip in zip(SIGNALS, choice, strict=True) if flip}

    return changed(min(product((0, 1), repeat=count), key=left))


def _changes(part: Part, point: Point) -> FloatArray:
    """What a run shows more (n, m) where each of `SIGNALS` is of the other kind: a column each."""
    run = part.run(point)
    assert run is not None, "a fit can be simulated"
    record = part.record
    columns, found, first = columns_of(run), np.zeros((record.size, len(SIGNALS))), 0
    for out in record.outputs:
        rows = slice(first, first + out.values.size)
        first = rows.stop
        column = columns[out.name]
        change = out.otherwise(run.time, column) - out.seen(run.time, column)
        found[rows, SIGNALS.index(out.name)] = change
    bend = record.bend_over(part.structure.value(point, "te_delay"))
    sign = -1.0 if record.curved else 1.0
    found[:, -1] = part.answer_to(point, run, {TORQUE: sign * bend})
    return found
