# SPDX-License-Identifier: MIT
"""Residual tests: whiteness, and correlation with the inputs.

Q per sample hardly notices a wrong model (docs/accuracy.md, faults that nobody states), since the
error is slow and the noise is not. Averages over blocks show it: white noise leaves 1/m of
its power in means over m samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.coloured_noise import (
    COLOURED_NOISE,
    compute_block_means,
    split_whitened,
)
from drivetwin.estimation.likelihood.objective import LikelihoodObjective
from drivetwin.estimation.optimize.objective import NormalEquations
from drivetwin.findings import Code, Finding, Number, Row, make_row, report
from drivetwin.simulation.dual_clutch import Signal

MAX_EXCESS_POWER = 1.6
"""Power of block means over that of white noise above which a warning is due."""
SIGNIFICANT = 5.0
"""Correlation with an input, in standard deviations of that of noise, from which it is no chance:
a warning is due, and the model does not hold."""

_ADVICE = (
    "Compare the simulation with the measurement in the report, phase by phase, and check these "
    "sensors for drift"
)


class Minimum(Protocol):
    """Minimum of an objective."""

    @property
    def problem(self) -> LikelihoodObjective[Any]:
        """Objective with its weighting at the minimum."""

    @property
    def normal(self) -> NormalEquations:
        """Expansion there."""


@dataclass(frozen=True)
class ResidualTest:
    """Residual of one output: `excess` power of its block means over white noise's, and its
    correlation with each input in units of the standard deviation that noise of that power would
    give."""

    output: str
    excess: float
    correlation: dict[str, float]

    @property
    def is_coloured(self) -> bool:
        """True if the block means have more power than those of white noise."""
        return self.excess > MAX_EXCESS_POWER

    @property
    def significant(self) -> dict[str, float]:
        """Correlations that are no chance, by input."""
        return {name: one for name, one in self.correlation.items() if abs(one) > SIGNIFICANT}


def compute_white_residuals(
    fit: Minimum, residuals: Sequence[FloatArray] | None = None
) -> dict[str, dict[str, tuple[FloatArray, FloatArray]]]:
    """Return times (n,) and normalised residuals (n,), input noise removed, by shift and output.

    Of a right model they are white with variance one, or less where input noise explains a part.
    `residuals` (n,) of each shift replace those of the fit.
    """
    return {
        term.label: {
            out.name: (term.record.time[out.place], white)
            for out, _, white in split_whitened(term, residual)
        }
        for term, residual in zip(fit.problem.terms, residuals or fit.normal.residuals, strict=True)
    }


def run_residual_tests(
    fit: Minimum, residuals: Sequence[FloatArray] | None = None
) -> dict[str, tuple[ResidualTest, ...]]:
    """Test every output by label of the shift; `residuals` as in `compute_white_residuals`."""
    found = {}
    whitened = compute_white_residuals(fit, residuals).values()
    for term, outputs in zip(fit.problem.terms, whitened, strict=True):
        found[term.label] = tuple(
            _run_test(name, time, white, term.inputs) for name, (time, white) in outputs.items()
        )
    return found


def check_residuals(
    fit: Minimum,
    labels: Sequence[str],
    residuals: Sequence[FloatArray] | None = None,
    likeliest: str = "",
    advice: str = _ADVICE,
) -> list[Finding]:
    """Return at most one finding of each kind, with a table of the signals that show it.

    Noise is correlated with no input, unless it is as slow as the log is long. A correlated
    residual shows a missing effect or a drift, whose influence on the parameters no interval
    covers.

    Parameters
    ----------
    labels : labels of the shifts
    residuals : as in `compute_white_residuals`
    likeliest, advice : cause that the log shows most, and what to do about it
    """
    tested = run_residual_tests(fit, residuals).values()
    pairs = [(label, test) for tests, label in zip(tested, labels, strict=True) for test in tests]
    coloured = [
        make_row(shift=label, channel=_write_name(test.output), power=test.excess)
        for label, test in pairs
        if test.is_coloured
    ]
    correlated = [
        make_row(
            shift=label,
            channel=_write_name(test.output),
            source=_write_name(source),
            size=size,
        )
        for label, test in pairs
        for source, size in test.significant.items()
    ]
    found = []
    if coloured:
        block, power = Number(COLOURED_NOISE.block, "s"), _get_largest(coloured, "power")
        one = report(Code.RESIDUAL_COLOURED, block=block, power=power)
        found.append(replace(one, rows=tuple(coloured)))
    if correlated:
        cause = f"likeliest cause: {likeliest}" if likeliest else "no listed effect explains it"
        size = _get_largest(correlated, "size")
        one = report(Code.RESIDUAL_CORRELATED, size=size, cause=cause, advice=advice)
        found.append(replace(one, rows=tuple(correlated)))
    return found


def _get_largest(rows: Sequence[Row], key: str) -> float:
    return max(abs(one.numbers[key].value) for one in rows)


def _write_name(name: str) -> str:
    return name.replace("_", " ")


def check_weighting(fit: Minimum, labels: Sequence[str]) -> list[Finding]:
    """Return a finding for each shift whose weighting omits the noise of the inputs.

    That is the case if a run has no finite response to the noise. `labels` are those of the shifts.
    """
    return [
        report(Code.INPUT_NOISE_OMITTED, label)
        for term, label in zip(fit.problem.terms, labels, strict=True)
        if term.weighting.path is None
    ]


def _run_test(
    name: str, time: FloatArray, white: FloatArray, inputs: Mapping[str, Signal]
) -> ResidualTest:
    _, means = compute_block_means(time, white)
    excess = float(np.mean(means**2) / np.mean(white**2))
    correlation = {}
    for source, signal in inputs.items():
        x = np.interp(time, signal.time, signal.values)
        x = x - x.mean()
        norm = float(np.linalg.norm(x) * np.sqrt(np.mean(white**2) * max(excess, 1.0)))
        correlation[source] = float(x @ white) / norm if norm > 0.0 else 0.0
    return ResidualTest(name, excess, correlation)
