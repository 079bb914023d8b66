# SPDX-License-Identifier: MIT
"""Starts of the fit: from beside and far from the truth, and where the model is wrong."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.dyno import ScenarioName
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.errors import IdentificationError
from drivetwin.estimation.likelihood.multistart import fit_local, fit_multistart, refine
from tests.estimation.likelihood.fixtures import ROUGH, bench, fitted, problem, truth_of
from tests.support.bench import Knowledge, record_bench

DRIVELINE = ("eta", "J_e", "J_out", "J_vehicle", "Tv_over_if", "k_o", "c_o")
DECREASE = 10.0
"""Decrease of Q from which inputs are formed anew."""


def test_ideal_sensors_return_every_parameter_from_a_start_beside_it() -> None:
    made = bench(noise=0.0, know=Knowledge(J_out=1.0))
    posed, start = problem(made, off=0.05)
    found = fit_multistart(posed, start)
    truth = truth_of(made)
    for name in (*DRIVELINE, "B3.mu_c", "B3.mu_drop", "B3.mu_v", "B3.ln_v_s"):
        assert found.point[name] == pytest.approx(truth[name], rel=2e-4), name
    assert found.point["te_delay"] == pytest.approx(truth["te_delay"], abs=2e-5)


def test_intervals_hold_the_truth_over_noise_realisations() -> None:
    deviates = []
    for seed in range(5):
        found, truth = fitted(seed), truth_of(bench(seed))
        std = np.sqrt(np.diag(found.covariance))
        assert found.chi2 == pytest.approx(1.0, abs=0.05)
        deviates += [
            (found.point[name] - truth[name]) / std[found.point.names.index(name)]
            for name in (*DRIVELINE, "te_delay", "B3.P0", "B3.mu_c")
        ]
    assert float(np.mean(np.square(deviates))) < 1.6
    assert float(np.max(np.abs(deviates))) < 4.0


def test_a_wrong_start_is_brought_in_by_draws() -> None:
    """That Jo′ starts at its least value makes no difference."""
    made = bench()
    posed, start = problem(made, off=0.4)
    values = start.values.copy()
    values[start.names.index("J_out")] = 0.0
    found = fit_multistart(posed, start.replace_values(values))
    assert found.chi2 < 1.05
    near = fitted()
    std = np.sqrt(np.diag(near.covariance))
    shared = [near.point.names.index(name) for name in DRIVELINE]
    assert np.all(np.abs(found.point.values - near.point.values)[shared] < 0.5 * std[shared])


def test_a_minimum_is_one_over_unknowns_and_inputs_alike() -> None:
    """B3 slips at twice the noise of its pressure above P0, B2 waits at its own."""
    base = load_scenario(ScenarioName.POWER_ON_DOWN)
    low = base.model.elements[1].P0 + 1.2e4
    knots = {
        "B3": ((2.15, 1.4e6), (2.20, low), (2.70, low), (2.75, 0.0)),
        "B2": (
            (2.30, 0.0),
            (2.32, 7.6e4),
            (2.60, 7.6e4),
            (2.75, 3e5),
            (2.95, 3.6e5),
            (3.05, 1.4e6),
        ),
    }
    actuators = {
        name: replace(one, command=replace(one.command, knots=knots[name]))
        for name, one in base.actuators.items()
    }
    posed, start = problem(record_bench(replace(base, actuators=actuators, duration=4.6), 1, ROUGH))
    found = fit_local(posed, start)
    assert found is not None
    again = posed.update_weighting(found.point).update_inputs(found.point)
    assert again.cost(found.point) > found.normal.cost - DECREASE


def test_a_log_that_the_model_cannot_follow_is_refused() -> None:
    """A fit that is known stays where no other start leads near."""
    made = bench()
    posed, start = problem(made)
    term = posed.terms[0]
    fixed = {**term.plant.fixed, "i_f": 1.3 * term.plant.driveline.i_f}
    wrong = replace(posed, terms=(replace(term, plant=replace(term.plant, fixed=fixed)),))
    with pytest.raises(IdentificationError, match="could not be brought onto the measurement"):
        fit_multistart(wrong, start)
    assert refine(fitted(), wrong, start) is fitted()
