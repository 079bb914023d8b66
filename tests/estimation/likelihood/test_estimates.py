# SPDX-License-Identifier: MIT
"""What is concluded from a fit where the card's design values and tolerances matter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.estimates import build_estimates
from drivetwin.estimation.likelihood.optimize.multistart import fit_local
from drivetwin.estimation.linear.estimates import apply_sensor_error
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.findings import Code
from drivetwin.vehicle.effects import EffectId, EffectPrior
from drivetwin.vehicle.spec import PriorValue, SensorTolerance
from tests.estimation.likelihood.fixtures import bench, fitted, problem
from tests.support.bench import Knowledge

CLOSE = Knowledge(J_out=0.02)
"""A card that knows Jo′ better than the log does."""
NO_EFFECT = EffectPriors({effect: EffectPrior(0.0) for effect in EffectId})
"""Effects off: what is tested here is the card and its sensors."""
OFFSET = 50.0
"""Error of the output torque [N m], one standard deviation of its tolerance."""


def _inertia(offset: float, tolerance: float) -> Estimate:
    made = bench(know=CLOSE)
    signals = apply_sensor_error(made.signals, "output_torque", SensorTolerance(offset=offset))
    posed, start = problem(replace(made, signals=signals))
    fit = fit_local(posed, start)
    assert fit is not None
    priors = replace(NO_EFFECT, sensors={"output_torque": SensorTolerance(offset=tolerance)})
    return build_estimates(fit, [signals], [made.driveline], {}, priors).estimates["J_out"]


def test_a_design_value_moves_by_little_with_a_sensor_within_its_tolerance() -> None:
    """The log shows the offset itself; without the tolerance it moves the value far."""
    sound, moved = _inertia(0.0, OFFSET), _inertia(OFFSET, OFFSET)
    untold = _inertia(OFFSET, 0.0)
    assert sound.verdict is moved.verdict is Verdict.DESIGN
    assert sound.value is not None
    assert moved.value is not None
    assert sound.std_noise is not None
    assert sound.std_systematic is not None
    assert sound.std_total == pytest.approx(np.hypot(sound.std_noise, sound.std_systematic))
    assert 0.0 < abs(moved.value - sound.value) < 2.0 * sound.std_systematic
    assert untold.value is not None
    assert abs(untold.value - sound.value) > 10.0 * sound.std_systematic


def test_a_design_value_that_the_log_contradicts_is_told_with_what_rests_on_it() -> None:
    made = bench()
    truth = made.run.scenario.model.J_out
    wrong = replace(made.driveline, J_out=PriorValue(2.0 * truth, 0.08 * truth))
    posed, start = problem(replace(made, driveline=wrong))
    fit = fit_local(posed, start)
    assert fit is not None
    told = build_estimates(fit, [made.signals], [wrong], {}, EffectPriors())
    (one,) = [each for each in told.findings if each.code is Code.CARD_CONTRADICTED]
    assert one.subject == "J_out"
    assert one.numbers["card"].value == pytest.approx(2.0 * truth)
    assert told.estimates["J_out"].verdict is Verdict.WEAK
    assert "Without the design value of J_out" in told.estimates["k_o"].reason
    assert told.estimates["k_o"].verdict is Verdict.WEAK
    assert told.estimates["Tv_over_if"].verdict is Verdict.IDENTIFIED
    sound = build_estimates(fitted(), [made.signals], [made.driveline], {}, EffectPriors())
    assert Code.CARD_CONTRADICTED not in [one.code for one in sound.findings]
