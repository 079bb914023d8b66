# SPDX-License-Identifier: MIT
"""Slow errors of a sensor widen intervals, white noise does not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from drivetwin.likelihood.covariance import compute_covariance
from tests.estimation.likelihood.fixtures import fitted
from tests.support.arrays import FloatArray

FILTER = 0.8
"""Share of a sample that stays until the next: a filter of 4.5 ms at 1 kHz."""


def _draw(count: int, slow: bool) -> FloatArray:
    """Sensor noise (n, count) of the fit's only shift; the output torque's of its power, filtered
    where it is `slow`."""
    (term,) = fitted().problem.terms
    noise = np.random.default_rng(1).standard_normal((term.record.size, count))
    torque = term.record.outputs[0]
    assert torque.name == "output_torque"
    if slow:
        rows = slice(torque.values.size)
        gain = np.sqrt(1.0 - FILTER**2)
        noise[rows] = lfilter([gain], [1.0, -FILTER], noise[rows], axis=0)
    return np.asarray(term.record.sigma[:, None] * noise)


def _spread(residual: FloatArray) -> FloatArray:
    fit = fitted()
    return compute_covariance(fit.problem, replace(fit.normal, residuals=(residual,)), 1.0)


def test_a_filtered_sensor_widens_intervals_to_what_its_noise_does() -> None:
    fit, noise = fitted(), _draw(100, slow=True)
    plain = _spread(_draw(1, slow=False)[:, 0])
    assert np.diag(plain @ fit.normal.information) == pytest.approx(1.0, rel=1e-6)
    moves = plain @ (fit.normal.regressors[0].T @ noise)
    spread = _spread(noise[:, 0])
    for name in ("eta", "Tv_over_if", "J_vehicle"):
        k = fit.point.names.index(name)
        scatter = float(np.std(moves[k]))
        assert scatter > 1.3 * np.sqrt(plain[k, k]), "the case is of no use"
        # Blocks of 20 ms show the noise of this filter nearly, a log's mean all of it.
        assert 0.7 * scatter < np.sqrt(spread[k, k]) < 1.5 * scatter
