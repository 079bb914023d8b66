# SPDX-License-Identifier: MIT
"""Slow errors: what a residual keeps over times in which white noise averages out.

A filter before the logger, or an effect that the model lacks, leaves a residual whose neighbours
go together. Sample by sample it may be no larger than the noise; over a quarter of a period of the
driveline it is, and that is what moves parameters.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.likelihood.objective import LikelihoodObjective, Term
from drivetwin.likelihood.output import Output
from drivetwin.likelihood.point import NormalEquations, find_acting
from drivetwin.likelihood.residual_covariance import Whitener


@dataclass(frozen=True)
class ColouredNoiseSettings:
    """Settings of the test for coloured residuals."""

    block: float = 0.02
    """Length of a block [s]: a quarter of a period of a driveline oscillation."""
    probes: int = 8
    """Probes of a weighting [count]; so many determine it to a few per cent."""
    significant: float = 5.0
    """Excess power of block means over white noise that is significant [standard deviations]."""


COLOURED_NOISE = ColouredNoiseSettings()

_PROBED: WeakKeyDictionary[Whitener, dict[str, tuple[float, float]]] = WeakKeyDictionary()
"""Result of the probes by weighting and name of the output: they do not depend on the residual."""


def split_whitened(term: Term, residual: FloatArray) -> Iterator[tuple[Output, slice, FloatArray]]:
    """Each output of a term, its rows among the samples (n,), and there the `residual` (n,) over
    the sensor's noise, input noise taken out. Of a right model that is white, of variance 1, or
    less at frequencies at which input noise explains a part of it.
    """
    white = residual - term.weighting.estimate_input_share(residual)
    white = white / term.weighting.sigma
    first = 0
    for out in term.record.outputs:
        rows = slice(first, first + out.values.size)
        first = rows.stop
        yield out, rows, white[rows]


def compute_block_means(time: FloatArray, white: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Middle times and means over blocks of `BLOCK`, scaled: white noise gives variance one."""
    size = _block(time)
    count = white.size // size
    means = white[: count * size].reshape(count, size).mean(axis=1)
    return time[: count * size].reshape(count, size).mean(axis=1), np.sqrt(size) * means


def _block(time: FloatArray) -> int:
    """Samples in a block."""
    return max(2, round(COLOURED_NOISE.block / float(np.median(np.diff(time)))))


def compute_long_run_excess(
    problem: LikelihoodObjective[Any], normal: NormalEquations, counted: float
) -> FloatArray:
    """Variance (p, p) of the gradient of Q/2 that slow errors of the outputs add to that of noise.

    Noise is `counted` so many times the sensors' power already. Errors as slow as the driveline
    act through their power per frequency there.
    """
    found = np.zeros_like(normal.information)
    for term, residual, regressors in zip(
        problem.terms, normal.residuals, normal.regressors, strict=True
    ):
        acting = find_acting(regressors)
        part = regressors[:, acting]
        for out, rows, white in split_whitened(term, residual):
            excess = compute_slow_power(term, out, rows, white) - counted
            if excess > 0.0:
                columns = term.weighting.sigma[rows, None] * part[rows]
                found[np.ix_(acting, acting)] += excess * columns.T @ columns
    return found


def compute_slow_power(term: Term, out: Output, rows: slice, white: FloatArray) -> float:
    """Power of a sensor's noise where the driveline is slow, over that stated; 1 where the block
    means of its residual `white` (n,) may as well be those of white noise.

    Input noise that explains a part of any residual takes it from slow errors too. How much is
    found by probes: one of random sign for each block, weighted as the residual was. What is slower
    than a block, as a drift, counts with its power over a block, which is less than it does.
    """
    _, means = compute_block_means(term.record.time[out.place], white)
    if means.size == 0:
        return 1.0
    power = float(np.mean(means**2))
    known = _PROBED.setdefault(term.weighting, {})
    if out.name not in known:
        known[out.name] = _by_probes(term, rows, _block(term.record.time[out.place]))
    usual, own = known[out.name]
    if power < usual * (1.0 + COLOURED_NOISE.significant * np.sqrt(2.0 / means.size)):
        return 1.0
    return 1.0 + (power - usual) / own


def _by_probes(term: Term, rows: slice, size: int) -> tuple[float, float]:
    """Power of means over `size` samples that noise of inputs and sensors leaves of the output at
    `rows`, and how much of it is this sensor's."""
    count = (rows.stop - rows.start) // size
    held = slice(rows.start, rows.start + count * size)
    signs = np.random.default_rng(0).choice([-1.0, 1.0], size=(count, COLOURED_NOISE.probes))
    probes = np.zeros((term.record.size, COLOURED_NOISE.probes))
    probes[held] = np.repeat(signs, size, axis=0) / np.sqrt(size)
    sigma = term.weighting.sigma[:, None]
    left = (probes - term.weighting.estimate_input_share(sigma * probes) / sigma)[held]
    means = left.reshape(count, size, COLOURED_NOISE.probes).sum(axis=1) / np.sqrt(size)
    return float(np.mean(signs * means)), float(np.mean(means**2))
