# SPDX-License-Identifier: MIT
"""What the log decides: a growing load, and what its signals are between their samples."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

from benchmarks.estimation.validity import make_log
from drivetwin.channels.roles import Quantity
from drivetwin.dyno.actuators import Program
from drivetwin.dyno.scenario import Scenario
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.estimation.likelihood.data.shift_record import TORQUE
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.selection.sampling_mode import SPEEDS
from drivetwin.estimation.likelihood.selection.select_model import select_model
from drivetwin.estimation.linear.load_balance import AERO
from drivetwin.estimation.result.estimate import Z95
from drivetwin.findings import Code, Finding
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.simulation.dual_clutch import RoadLoad
from drivetwin.vehicle.effects import EffectId
from tests.estimation.likelihood.fixtures import truth_of
from tests.support.bench import Bench, Knowledge, record_bench
from tests.support.repeats import mark_repeats

GROWTH = 4.0


def _sent(scenario: Scenario, rate: float, means: bool) -> Scenario:
    """The scenario with speeds sent at `rate` [Hz], as means since the one before or as samples."""
    sensors = [
        replace(one, rate=rate, window=means / rate) if one.quantity is Quantity.SPEED else one
        for one in scenario.sensors
    ]
    return replace(scenario, sensors=tuple(sensors))


def _chosen(made: Bench) -> tuple[LikelihoodFit, tuple[Finding, ...]]:
    law = made.run.scenario.model.loss_law
    return select_model([made.signals], [made.driveline], law, truth_of(made), EffectPriors())


def _deviation(fit: LikelihoodFit, name: str, truth: float) -> float:
    k = fit.point.names.index(name)
    return abs(fit.mean[name] - truth) / float(np.sqrt(fit.covariance[k, k]))


def test_a_growing_load_is_found_and_told_at_the_mean_speed() -> None:
    base = load_scenario("throttle_steps")
    load = RoadLoad(base.model.load.constant, aero=GROWTH)
    made = record_bench(replace(base, model=replace(base.model, load=load)), 0, Knowledge())
    fit, notes = _chosen(made)
    assert any(note.code is Code.LOAD_GROWS for note in notes)
    speed = fit.problem.terms[0].structure.mean_speed
    assert _deviation(fit, AERO, GROWTH) < 3.5
    assert _deviation(fit, "Tv_over_if", load.evaluate(speed) / base.model.i_f) < 3.5
    assert _deviation(fit, "J_vehicle", base.model.J_v) < 3.5


@pytest.mark.parametrize("rate", mark_repeats([100.0, 500.0, 1000.0], [100.0]))
@pytest.mark.parametrize("means", [True, False])
def test_speeds_are_taken_for_what_they_are(rate: float, means: bool) -> None:
    made = record_bench(_sent(load_scenario("paper_steps"), rate, means), 0, Knowledge())
    fit, notes = _chosen(made)
    assert (Code.MEAN_SAMPLES in [note.code for note in notes]) == means
    assert fit.problem.modes == (frozenset(SPEEDS) if means else frozenset())
    assert AERO not in fit.point.names
    assert fit.chi2 == pytest.approx(1.0, abs=0.05)
    truth = truth_of(made)
    for name in ("eta", "J_e", "J_vehicle", "k_o", "c_o", "te_delay"):
        assert _deviation(fit, name, truth[name]) < 3.5, name


def test_without_an_output_torque_speeds_are_told_apart_all_the_same() -> None:
    made = record_bench(_sent(load_scenario("paper_steps"), 100.0, True), 0, Knowledge(J_out=0.1))
    nothing = MeasuredSignal(np.empty(0), np.empty(0))
    fit, _ = _chosen(replace(made, signals=replace(made.signals, output_torque=nothing)))
    assert fit.problem.modes == frozenset(SPEEDS)
    assert _deviation(fit, "te_delay", truth_of(made)["te_delay"]) < 3.5


def test_an_engine_torque_that_comes_rarely_is_taken_for_a_curve() -> None:
    base = load_scenario("paper_steps")
    time = np.arange(0.0, base.duration, 2e-3)
    smooth = uniform_filter1d(uniform_filter1d(base.engine_torque.evaluate(time), 25), 25)
    pedal = Program(tuple(zip(time.tolist(), smooth.tolist(), strict=True)))
    sensors = [
        replace(one, rate=50.0, noise=0.5, resolution=0.0) if one.role == "engine_torque" else one
        for one in base.sensors
    ]
    scenario = replace(base, engine_torque=pedal, sensors=tuple(sensors))
    made = record_bench(scenario, 0, Knowledge())
    fit, _ = _chosen(made)
    assert fit.problem.modes == frozenset({TORQUE})
    assert fit.chi2 == pytest.approx(1.0, abs=0.05)
    truth = truth_of(made)
    for name in ("eta", "J_e", "J_vehicle", "k_o", "c_o", "te_delay"):
        assert _deviation(fit, name, truth[name]) < 3.5, name


def test_a_sampling_mode_does_not_take_the_place_of_an_effect() -> None:
    """Without the slip of the tyres the wheel speed counts as samples, which are means, at odds of
    200 to one: the damping is then too high by 2.3 standard deviations."""
    made, _ = make_log(2000, EffectId.TYRE_SLIP, 1.0)
    found = identify(made.log, made.card, detect_shifts(made.log, made.card))
    for name in ("c_o", "zeta_3"):
        one, truth = found.estimates[name], made.recorded.truth.parameters[name]
        assert one.value is not None
        assert one.std_total is not None
        assert abs(one.value - truth) < Z95 * one.std_total
