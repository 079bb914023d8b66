# SPDX-License-Identifier: MIT
"""Friction of free shape follows the true law within its band; a falling one falls."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.errors import IdentificationError
from drivetwin.estimation.analysis.friction_shape import fit_friction_shape, project_shape
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.result.estimate import Z95, FrictionCurve
from drivetwin.estimation.result.method import FrictionShape
from drivetwin.vehicle.spec import SensorTolerance
from tests.estimation.asked import by_the_paper, stepped
from tests.support import bench

NO_EFFECT = EffectPriors(bench.NO_EFFECT)


def test_free_shape_holds_the_truth() -> None:
    found = stepped()
    one = fit_friction_shape(found, FrictionShape.FREE, NO_EFFECT)
    curve = one.curves["B3"]
    truth = load_scenario("paper").model.elements[1].friction.evaluate(curve.slip)
    inside = (truth >= curve.mu_lo) & (truth <= curve.mu_hi)
    assert inside.mean() > 0.8
    assert np.abs(curve.mu - truth).max() < 0.004
    law = found.friction["B3"]
    assert np.mean(curve.mu_hi - curve.mu_lo) > np.mean(law.mu_hi - law.mu_lo)
    assert curve.stribeck is None
    # The Stribeck law is the truth: a dozen knots gain no more than their number.
    assert -3.0 < one.gain < 20.0
    assert one.bend > 0.0


def test_falling_shape_falls_and_sensors_and_effects_widen_its_band() -> None:
    tolerance = {"output_torque": SensorTolerance(gain=0.01)}
    narrow, by_sensors, by_effects = (
        fit_friction_shape(stepped(), FrictionShape.FALLING, given).curves["B3"]
        for given in (NO_EFFECT, replace(NO_EFFECT, sensors=tolerance), EffectPriors())
    )
    assert np.diff(narrow.mu).max() <= 1e-9
    for wide in (by_sensors, by_effects):
        assert measure_width(wide) > 1.5 * measure_width(narrow)


def measure_width(curve: FrictionCurve) -> float:
    """Mean width of the band without the part of the gain."""
    assert curve.gain is not None
    of_gain = 2.0 * Z95 * curve.mu * curve.gain.std / curve.gain.value
    return float(np.mean(np.sqrt((curve.mu_hi - curve.mu_lo) ** 2 - of_gain**2)))


def test_without_a_torque_scale_a_shape_is_over_eta_as_its_law_was() -> None:
    found = stepped()
    ratio = replace(found, friction={"B3": replace(found.friction["B3"], over_eta=True)})
    curve = fit_friction_shape(ratio, FrictionShape.FREE, NO_EFFECT).curves["B3"]
    assert curve.over_eta
    assert curve.method_text == "likelihood, free shape, μ over η"


def test_other_methods_are_refused() -> None:
    with pytest.raises(IdentificationError, match="paper method"):
        fit_friction_shape(by_the_paper(), FrictionShape.FREE, NO_EFFECT)


@settings(max_examples=10)
@given(
    st.integers(0, 10_000),
    st.integers(2, 8),
    st.sampled_from([FrictionShape.FALLING, FrictionShape.RISING]),
)
def test_is_monotone_and_no_neighbour_is_nearer(seed: int, size: int, shape: FrictionShape) -> None:
    rng = np.random.default_rng(seed)
    factor = rng.standard_normal((size, size)) + 2.0 * np.eye(size)
    covariance = factor @ factor.T
    free = rng.standard_normal(size)
    mu, within = project_shape(shape, free, covariance)
    steps = np.diff(mu) if shape is FrictionShape.RISING else -np.diff(mu)
    assert steps.min() > -1e-8
    inverse = np.linalg.inv(covariance)

    def distance(x: np.typing.NDArray[np.float64]) -> float:
        return float((x - free) @ inverse @ (x - free))

    best = distance(mu)
    for _ in range(20):
        other = np.sort(mu + 0.1 * rng.standard_normal(size))
        other = other if shape is FrictionShape.RISING else other[::-1]
        assert distance(other) > best - 1e-7
    assert np.all(np.linalg.eigvalsh(covariance - within) > -1e-7 * np.trace(covariance))


def test_a_curve_of_that_shape_stays_as_it_is() -> None:
    mu, covariance = np.array([0.14, 0.12, 0.11]), 1e-6 * np.eye(3)
    for shape in (FrictionShape.FREE, FrictionShape.FALLING):
        reported, within = project_shape(shape, mu, covariance)
        assert reported == pytest.approx(mu, abs=1e-9)
        assert within == pytest.approx(covariance, abs=1e-12)
