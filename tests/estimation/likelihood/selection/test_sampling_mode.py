# SPDX-License-Identifier: MIT
"""Averages over sampling modes where a log hardly determines them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from drivetwin.channels.roles import Quantity
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.optimize.multistart import MULTI_START, fit_local
from drivetwin.estimation.likelihood.priors import build_problem
from drivetwin.estimation.likelihood.selection import sampling_mode as of_signals
from drivetwin.estimation.likelihood.selection.sampling_mode import (
    SPEEDS,
    average_modes,
    refit_best_mode,
    refit_slow_outputs,
    select_sampling_mode,
    widen_over_modes,
)
from drivetwin.estimation.likelihood.shift_objective import ShiftObjective
from drivetwin.estimation.optimize.objective import ParameterVector
from tests.estimation.likelihood.fixtures import ROUGH, problem, truth_of
from tests.support.bench import record_bench
from tests.support.shared_results import shared

MEANS = frozenset({"output_torque"})
UNDECIDED = 78
"""Seed of a noise whose Q is lower by 4.7 of 26,847 with means of the output torque, which are
none."""
AS_READ = 2
"""Seed of a noise with which an expansion takes means over 20 ms for samples."""


@cache
def _posed() -> ShiftObjective:
    return problem(record_bench(load_scenario("throttle_steps"), UNDECIDED, ROUGH))[0]


@shared
def _fit(modes: frozenset[str]) -> LikelihoodFit:
    _, start = problem(record_bench(load_scenario("throttle_steps"), UNDECIDED, ROUGH))
    found = fit_local(_posed().select_modes(modes), start)
    assert found is not None
    return found


def _get_delay(fit: LikelihoodFit) -> tuple[float, float]:
    """The estimated delay and its standard deviation [s]."""
    k = fit.point.names.index("te_delay")
    return fit.mean["te_delay"], float(np.sqrt(fit.covariance[k, k]))


def test_two_modes_that_the_log_hardly_tells_are_both_within_the_interval() -> None:
    delays = [_fit(modes).point["te_delay"] for modes in (frozenset[str](), MEANS)]
    sharp = _get_delay(_fit(MEANS))[1]
    assert abs(delays[0] - delays[1]) > 5.0 * sharp
    averaged, doubts = average_modes(_posed(), _fit(MEANS))
    value, std = _get_delay(averaged)
    assert all(abs(delay - value) < 1.96 * std for delay in delays)
    truth = record_bench(load_scenario("throttle_steps"), UNDECIDED, ROUGH).truth["te_delay"]
    assert abs(truth - value) < 1.96 * std
    assert len(doubts) == 1
    assert doubts[0].names["channels"] == "output torque"


def test_it_does_not_matter_from_which_mode_one_comes() -> None:
    one, other = (
        _get_delay(average_modes(_posed(), refit_best_mode(_posed(), _fit(modes)))[0])
        for modes in (frozenset[str](), MEANS)
    )
    assert one[0] == pytest.approx(other[0], abs=0.1 * one[1])
    assert one[1] == pytest.approx(other[1], rel=0.1)


def test_a_clear_log_is_left_as_it_is() -> None:
    posed, start = problem(record_bench(load_scenario("paper_steps"), 0, ROUGH))
    fit = fit_local(posed, start)
    assert fit is not None
    averaged, doubts = average_modes(posed, fit)
    std = np.sqrt(np.diag(fit.covariance))
    assert doubts == []
    assert np.all(np.abs(averaged.mean.values - fit.point.values) < 1e-3 * std)
    assert np.diag(averaged.covariance) == pytest.approx(np.diag(fit.covariance), rel=1e-3)


def test_the_expansion_foretells_the_other_minimum() -> None:
    here, there = _fit(MEANS), _fit(frozenset[str]())
    averaged, _ = average_modes(_posed(), here)
    added = averaged.covariance - here.covariance
    k = here.point.names.index("te_delay")
    apart = there.point["te_delay"] - here.point["te_delay"]
    share = (averaged.mean["te_delay"] - here.point["te_delay"]) / apart
    assert 0.0 < share < 1.0
    assert added[k, k] >= 0.99 * share * (1.0 - share) * apart**2
    assert np.all(np.linalg.eigvalsh(added) > -1e-9 * np.max(np.linalg.eigvalsh(added)))


def test_what_another_search_alone_lowers_speaks_for_no_mode(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    here, there = _fit(MEANS), _fit(frozenset[str]())

    def average(fall: float) -> float:
        """The delay where every search after the first ends so much lower in Q."""
        again = {
            one.problem.modes: replace(one, normal=replace(one.normal, cost=one.normal.cost - fall))
            for one in (here, there)
        }
        monkeypatch.setattr(of_signals, "_nearby", lambda posed, *_: again.get(posed.modes))
        return average_modes(_posed(), here)[0].mean["te_delay"]

    std = _get_delay(here)[1]
    assert abs(average(0.0) - here.point["te_delay"]) > 0.1 * std
    assert average(8.0) == pytest.approx(average(0.0), abs=0.02 * std)


@shared
def _without_torque() -> tuple[ShiftObjective, ParameterVector, LikelihoodFit]:
    """A problem of samples without an output torque, where its search starts, and its minimum."""
    made = record_bench(load_scenario("throttle_steps"), 0, ROUGH)
    signals = replace(made.signals, output_torque=MeasuredSignal(np.empty(0), np.empty(0)))
    eta = made.truth["eta"]
    scaled = ("J_e", "J_out", "J_vehicle", "Tv_over_if", "k_o", "c_o")
    guess = {
        name: value / eta if name in scaled or ".mu_" in name else value
        for name, value in truth_of(made).items()
    }
    law = made.run.scenario.model.loss_law
    posed, start = build_problem([signals], [made.driveline], law, guess)
    best = fit_local(posed, start)
    assert best is not None
    return posed, start, best


def test_modes_are_compared_by_the_same_samples() -> None:
    assert _posed().select_modes(SPEEDS).size == _posed().size


def test_from_far_off_the_lower_gear_determines_modes() -> None:
    """Speeds that a bus sends as means over 10 ms, with pedal steps, from a poor start."""
    base = load_scenario("throttle_steps")
    sensors = [
        replace(one, rate=100.0, window=0.01) if one.quantity is Quantity.SPEED else one
        for one in base.sensors
    ]
    made = record_bench(replace(base, sensors=tuple(sensors)), 0, ROUGH)
    posed, start = problem(made, off=0.1)
    assert posed.update_weighting(start).cost(start) > MULTI_START.far_chi2 * posed.size
    likely, _ = select_sampling_mode(posed, start, [made.signals.shift])
    assert frozenset(SPEEDS) <= likely.modes


def test_without_an_output_torque_the_interval_reaches_the_other_mode_of_speeds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    posed, _, best = _without_torque()
    monkeypatch.setattr(of_signals, "TIE", np.inf)
    wide, doubts = widen_over_modes(posed, best)
    other = fit_local(posed.select_modes(frozenset(SPEEDS)), best.point)
    assert other is not None
    far = abs(other.point["te_delay"] - best.point["te_delay"])
    assert far == pytest.approx(0.5e-3, rel=0.3)  # half a period of the speeds
    assert far < 1.96 * _get_delay(wide)[1]
    assert "engine speed" in doubts[0].text
    monkeypatch.setattr(of_signals, "TIE", -np.inf)
    assert widen_over_modes(posed, best) == (best, [])


def test_with_an_output_torque_the_speeds_show_of_what_mode_they_are() -> None:
    fit = _fit(MEANS)
    assert widen_over_modes(_posed(), fit) == (fit, [])


@shared
def _at_50_hertz(window: float) -> tuple[ShiftObjective, LikelihoodFit]:
    """A problem of outputs every 20 ms that are means over the `window` [s], and its minimum with
    the modes of an expansion."""
    base = load_scenario("throttle_steps")
    sensors = [
        replace(one, rate=50.0, window=window)
        if one.quantity is Quantity.SPEED or one.role == "output_torque"
        else one
        for one in base.sensors
    ]
    posed, start = problem(record_bench(replace(base, sensors=tuple(sensors)), AS_READ, ROUGH))
    fit = fit_local(posed, start)
    assert fit is not None
    return posed, refit_best_mode(posed, fit)


def test_slow_outputs_are_tried_as_the_other_mode_for_no_expansion_reaches_so_far() -> None:
    posed, known = _at_50_hertz(0.02)
    assert known.problem.modes == frozenset()
    assert abs(_get_delay(known)[0]) > 20.0 * _get_delay(known)[1]  # half a period of the outputs
    averaged = refit_slow_outputs(posed, known)
    assert averaged.problem.modes == {*SPEEDS, "output_torque"}
    assert abs(_get_delay(averaged)[0]) < 2.0 * _get_delay(averaged)[1]


def test_slow_samples_stay_samples() -> None:
    posed, known = _at_50_hertz(0.0)
    assert known.problem.modes == frozenset()
    assert refit_slow_outputs(posed, known) is known
