# SPDX-License-Identifier: MIT
"""What the log decides: a growing load, and speeds that are means over their period."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.estimation.bench import Bench, Knowledge, realise
from drivetwin.driveline import RoadLoad
from drivetwin.dyno.scenarios import throttle_steps
from drivetwin.identify.likelihood.fit import LikelihoodFit
from drivetwin.identify.likelihood.unknowns import AERO
from drivetwin.identify.likelihood.variants import choose
from drivetwin.identify.signals import Sampled
from tests.identify.likelihood.made import truth_of

GROWTH = 4.0
WINDOW = 10


def _means(signal: Sampled) -> Sampled:
    """What an encoder on a bus sends of a 1 kHz signal: means over the past 10 ms."""
    count = (signal.values.size - 1) // WINDOW
    means = signal.values[1 : 1 + count * WINDOW].reshape(count, WINDOW).mean(axis=1)
    sigma = signal.sigma / np.sqrt(WINDOW)
    return Sampled(signal.time[WINDOW : 1 + count * WINDOW : WINDOW], means, sigma)


def _chosen(made: Bench) -> tuple[LikelihoodFit, tuple[str, ...]]:
    law = made.run.scenario.model.loss_law
    return choose([made.signals], [made.driveline], law, truth_of(made))


def _deviation(fit: LikelihoodFit, name: str, truth: float) -> float:
    k = fit.point.names.index(name)
    return abs(fit.point[name] - truth) / float(np.sqrt(fit.covariance[k, k]))


def test_a_growing_load_is_found_and_told_at_the_mean_speed() -> None:
    base = throttle_steps()
    load = RoadLoad(base.model.load.constant, aero=GROWTH)
    made = realise(replace(base, model=replace(base.model, load=load)), 0, Knowledge())
    fit, notes = _chosen(made)
    assert any("grows with the square of the speed" in note for note in notes)
    speed = fit.problem.parts[0].structure.mean_speed
    assert _deviation(fit, AERO, GROWTH) < 3.5
    assert _deviation(fit, "Tv_over_if", load.at(speed) / base.model.i_f) < 3.5
    assert _deviation(fit, "J_vehicle", base.model.J_v) < 3.5


def test_speeds_sent_as_means_are_taken_for_means() -> None:
    made = realise(throttle_steps(), 0, Knowledge())
    signals = made.signals
    assert signals.wheel_speed is not None
    slow = replace(
        signals,
        engine_speed=_means(signals.engine_speed),
        output_speed=_means(signals.output_speed),
        wheel_speed=_means(signals.wheel_speed),
    )
    fit, notes = _chosen(replace(made, signals=slow))
    assert any("means over their period" in note for note in notes)
    assert AERO not in fit.point.names
    assert fit.chi2 == pytest.approx(1.0, abs=0.05)
    truth = truth_of(made)
    for name in ("eta", "J_e", "J_vehicle", "k_o", "te_delay"):
        assert _deviation(fit, name, truth[name]) < 3.5, name
