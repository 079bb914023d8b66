# SPDX-License-Identifier: MIT
"""Residual tests: whiteness, correlation with the inputs, and orders of a shaft.

Q per sample hardly notices a wrong model, since the error is slow and the noise is not. Averages
over blocks show it: white noise leaves 1/m of its power in means over m samples.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Protocol

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.findings import Code, Finding, Number, Row, make_row, report
from drivetwin.likelihood.coloured_noise import COLOURED_NOISE, compute_block_means, split_whitened
from drivetwin.likelihood.objective import LikelihoodObjective, Term
from drivetwin.likelihood.point import NormalEquations
from drivetwin.simulation.dual_clutch import Signal


@dataclass(frozen=True)
class OrderSettings:
    """Settings of the search for orders."""

    shown: float = 20.0
    """Power of an order over that of its neighbours, in nats, from which it is no chance: the
    odds of one among a thousand orders and shafts are e⁻¹³."""
    least_turns: float = 5.0
    """Turns of a shaft from which its orders differ from those of its neighbours [count]."""
    beside: tuple[float, ...] = (-1.5, -1.25, -1.0, 1.0, 1.25, 1.5)
    """Distances of the neighbours, in orders that the turns resolve [count]."""
    resolved: float = 2.0
    """Distance of orders that the turns resolve, over the inverse of their number [ratio]."""


ORDERS = OrderSettings()
CAUSES: Mapping[int, str] = {
    1: "a toothed wheel or shaft off its centre",
    2: "a joint at an angle, or the firing of four cylinders",
    3: "the firing of six cylinders",
    4: "the firing of eight cylinders",
}
"""Usual causes by order."""


@dataclass(frozen=True)
class Order:
    """Order of the residual of an output over the angle of a shaft, with its power over that of
    its neighbours."""

    output: str
    shaft: str
    number: int
    power: float


def find_order(problem: LikelihoodObjective[Any], residuals: Sequence[FloatArray]) -> list[Finding]:
    """Return a finding on the order that the residuals (n,) show most, if it is no chance."""
    found = [
        one
        for term, residual in zip(problem.terms, residuals, strict=True)
        for one in _list_orders(term, residual)
    ]
    best = max(found, key=lambda one: one.power, default=None)
    if best is None or best.power < ORDERS.shown:
        return []
    return [
        report(
            Code.RESIDUAL_ORDER,
            channel=best.output.replace("_", " "),
            shaft=best.shaft.replace("_", " "),
            order=best.number,
            cause=CAUSES[best.number],
            power=best.power,
        )
    ]


def _list_orders(term: Term, residual: FloatArray) -> Iterator[Order]:
    """Yield the orders of each output over the angle of each measured speed."""
    outputs = list(split_whitened(term, residual))
    time = term.record.time
    for speed in (out for out, _, _ in outputs if out.name in term.speeds):
        at = time[speed.place]
        steps = 0.5 * (speed.values[1:] + speed.values[:-1]) * np.diff(at)
        angle = np.concatenate([[0.0], np.cumsum(steps)])
        turns = abs(angle[-1]) / (2.0 * np.pi)
        if turns < ORDERS.least_turns:
            continue
        for out, _, white in outputs:
            phase = np.interp(time[out.place], at, angle)
            for number in CAUSES:
                if 2.0 * number * turns < out.values.size:
                    power = _compare_power(white, phase, number, turns)
                    yield Order(out.name, speed.name, number, power)


def _compare_power(white: FloatArray, phase: FloatArray, number: int, turns: float) -> float:
    """Compute the power of an order of a residual (n,) over that of its neighbours."""
    beside = number + ORDERS.resolved / turns * np.array(ORDERS.beside)
    orders = np.concatenate([[float(number)], beside])
    power = np.abs(np.exp(-1j * np.outer(orders, phase)) @ white) ** 2 / white.size
    return float(power[0] / max(float(np.mean(power[1:])), 1.0))


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
    """Return times (n,) and normalised residuals (n,), input noise removed, by recording and
    output.

    Of a right model they are white with variance one, or less where input noise explains a part.
    `residuals` (n,) of each recording replace those of the fit.
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
    """Test every output by label of the recording; `residuals` as in `compute_white_residuals`."""
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
    labels : labels of the recordings
    residuals : as in `compute_white_residuals`
    likeliest, advice : cause that the log shows most, and what to do about it
    """
    tested = run_residual_tests(fit, residuals).values()
    pairs = [(label, test) for tests, label in zip(tested, labels, strict=True) for test in tests]
    coloured = [
        make_row(recording=label, channel=_write_name(test.output), power=test.excess)
        for label, test in pairs
        if test.is_coloured
    ]
    correlated = [
        make_row(
            recording=label,
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
    """Return a finding for each recording whose weighting omits the noise of the inputs.

    That is the case if a run has no finite response to the noise. `labels` are those of the
    recordings.
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
