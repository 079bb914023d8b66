# SPDX-License-Identifier: MIT
"""What kind of signals a log holds: samples or means, an engine torque of lines or of curves.

An output may be the mean over the time since the sample before, as encoders on a bus send it. That
is half a sample late, and half a millisecond between torque and speed moves k_o and c_o by several
standard deviations. Between its samples an engine torque may be straight or a curve (`bend_of`).
Which kind fits better is told by the expansion of Q at the minimum of one of them: what the others
would show differs by a known column each.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from drivetwin.identify.likelihood.fit import LikelihoodFit, nearest
from drivetwin.identify.likelihood.newton import step_of
from drivetwin.identify.likelihood.problem import Part, Problem
from drivetwin.identify.likelihood.record import OUTPUTS, TORQUE, columns_of
from drivetwin.identify.likelihood.unknowns import Point
from drivetwin.identify.signals import FloatArray

SIGNALS = (*OUTPUTS, TORQUE)
SPEEDS = tuple(name for name in OUTPUTS if name.endswith("speed"))
LIKELY = tuple(
    frozenset(means) | bent for means in ((), SPEEDS) for bent in (frozenset({TORQUE}), frozenset())
)
"""Kinds that a search may start with: all speeds alike."""
GAIN = 4.0
"""Promised fall of Q from which on signals change their kind: two standard deviations."""
ROUNDS = 3
"""Most changes of kind: far off, the expansion promises the way, not the end of it."""


def likely_kinds(problem: Problem, start: Point) -> list[Problem]:
    """The problem, which has signals as read, with each of `LIKELY`; the likelier first."""
    found = [problem.of_kinds(kinds) for kinds in LIKELY]
    return sorted(found, key=lambda one: one.cost(start) / one.size)


def with_kinds(problem: Problem, best: LikelihoodFit) -> LikelihoodFit:
    """The fit with every signal of the kind that leaves less.

    `problem` has signals as read, `best` is its fit with some kinds.
    """
    for _ in range(ROUNDS):
        kinds = best.problem.kinds ^ _promising(best)
        if kinds == best.problem.kinds:
            break
        other = nearest(problem.of_kinds(kinds), best.point)
        if other is None or other.chi2 >= best.chi2:
            break
        best = other
    return best


def in_words(kinds: frozenset[str]) -> list[str]:
    """What is said of signals that are not as read."""
    means = ", ".join(name.replace("_", " ") for name in OUTPUTS if name in kinds)
    return [f"samples are means over their period, which fits better: {means}"] if means else []


def _promising(fit: LikelihoodFit) -> frozenset[str]:
    """Names of the signals that, taken for the other kind together, promise the least Q.

    None unless they promise `GAIN`. With the residual r - B·s, where s picks columns of B, Q is
    Q(0) - 2·sᵀBᵀΣ⁻¹r + sᵀBᵀΣ⁻¹B·s before the parameters follow.
    """
    count = len(SIGNALS)
    through, square = np.zeros(count), np.zeros((count, count))
    pull = np.zeros((len(fit.point.names), count))
    for part, residual, regressors in zip(
        fit.problem.parts, fit.normal.residuals, fit.normal.regressors, strict=True
    ):
        change = _changes(part, fit.point)
        weighted = part.weighting.weighted(change)
        through += weighted.T @ residual
        square += change.T @ weighted
        pull += regressors.T @ change

    def left(choice: FloatArray) -> float:
        gradient = fit.normal.gradient + pull @ choice
        followed = gradient @ step_of(fit.normal.information, gradient)
        return float(-2.0 * choice @ through + choice @ square @ choice + followed)

    choices = [np.array(each, dtype=float) for each in product((0, 1), repeat=count)]
    best = min(choices, key=left)
    if left(choices[0]) - left(best) < GAIN:
        return frozenset()
    return frozenset(name for name, chosen in zip(SIGNALS, best, strict=True) if chosen)


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
