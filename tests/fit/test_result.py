# SPDX-License-Identifier: MIT
"""Result of a fit: values, covariance, fitted model, findings."""

from __future__ import annotations

import pickle
from dataclasses import replace
from math import sqrt

import numpy as np
import pytest

from drivetwin.estimation.result.estimate import Z95, Verdict
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.findings import Code
from drivetwin.fit.fit import fit_network
from drivetwin.fit.result import WITH_PRIOR
from drivetwin.fit.synthesize import ModelName
from drivetwin.fit.unknown import Unknown
from drivetwin.simulation.network import simulate
from drivetwin.simulation.network_sensitivity import get_number
from tests.support.fits import fit_log, make_log

FOUND = ModelName.ENGINE_START


def test_the_fitted_model_has_the_values_in_its_elements_and_as_first_guesses() -> None:
    found = fit_log(FOUND)
    for name, value in found.values.items():
        assert get_number(found.fitted.elements, name) == pytest.approx(value)
        assert found.fitted.unknowns[name].value == pytest.approx(value)
        assert found.fitted.unknowns[name].std == found.model.unknowns[name].std
        assert get_number(found.model.elements, name) == make_log(FOUND).model.unknowns[name].value


def test_the_runs_are_those_of_the_fitted_model() -> None:
    found = fit_log(FOUND)
    (run,) = found.simulate()
    (term,) = found.problem.terms
    model, inputs = found.fitted, dict(term.record.inputs)
    for name, one in model.expressions.items():
        head, _, channel = name.partition(".")
        assert head == "gain"
        read = inputs[channel]
        inputs[channel] = replace(read, values=float(str(one.formula)) * read.values)
    again = simulate(list(model.elements), inputs, model.start, run.time, list(run.columns))
    for output, column in run.columns.items():
        assert again.columns[output] == pytest.approx(column, abs=1e-6)


def test_q_is_that_of_the_samples_and_of_the_priors() -> None:
    found = fit_log(FOUND)
    prior = found.problem.prior.compute_prior_cost(found.minimum.point.values)
    assert found.cost == pytest.approx(found.chi2 * found.problem.size + prior)
    assert prior > 0.0


def test_intervals_are_symmetric_by_the_logarithm_and_agree_with_the_deviations() -> None:
    found = fit_log(FOUND)
    for one in found.sought:
        low, high = found.intervals[one.name]
        value, std = found.values[one.name], found.std[one.name]
        assert sqrt(low * high) == pytest.approx(value)
        assert np.log(high / low) / 2.0 == pytest.approx(Z95 * std / value)
        estimate = found.estimates[one.name]
        assert estimate.value == pytest.approx(value)
        assert estimate.std_noise == pytest.approx(std)
        assert estimate.method == WITH_PRIOR
        assert std < float(one.stated.std or np.inf)


def test_the_correlation_has_a_unit_diagonal() -> None:
    correlation = fit_log(FOUND).correlation
    assert np.diag(correlation) == pytest.approx(1.0)
    assert correlation == pytest.approx(correlation.T)
    assert np.max(np.abs(correlation)) <= 1.0 + 1e-12


def test_the_starts_are_compared_and_the_best_is_counted() -> None:
    found = fit_log(FOUND)
    assert 1 <= found.agreeing <= len(found.starts)
    assert min(one.cost for one in found.starts) < np.inf


def test_a_result_is_stored_and_simulates_as_before() -> None:
    found = fit_log(FOUND)
    again = pickle.loads(pickle.dumps(found))
    assert again.values == found.values
    (one,), (other,) = again.simulate(), found.simulate()
    for output, column in other.columns.items():
        assert np.array_equal(one.columns[output], column)


def test_a_prior_that_the_recordings_contradict_limits_all_values() -> None:
    made = make_log(ModelName.TIP_IN)
    wrong = {**made.model.unknowns, "motor.inertia": Unknown(0.06, 0.0004)}
    found = fit_network(replace(made.model, unknowns=wrong), [made.recording])
    (finding,) = (one for one in found.findings if one.code is Code.PRIOR_CONTRADICTED)
    assert "motor.inertia is 0.0" in finding.text
    assert found.status is not ModelStatus.VALID
    verdicts = {one.verdict for one in found.estimates.values()}
    assert not verdicts & {Verdict.IDENTIFIED, Verdict.DESIGN}
    # A prior as far off moves nothing where the recordings know the number much better.
    loose = {**made.model.unknowns, "shaft.gap": Unknown(0.015, 0.0013)}
    right = fit_network(replace(made.model, unknowns=loose), [made.recording])
    assert right.status is ModelStatus.VALID
    (warned,) = (one for one in right.findings if one.code is Code.PRIOR_MISSED)
    assert "shaft.gap is 0.02" in warned.text


def test_a_bound_that_the_recordings_contradict_limits_all_values() -> None:
    made = make_log(ModelName.TIP_IN)
    bounded = {**made.model.unknowns, "shaft.gap": Unknown(0.023, bounds=(0.022, 0.04))}
    found = fit_network(replace(made.model, unknowns=bounded), [made.recording])
    (finding,) = (one for one in found.findings if one.code is Code.AT_BOUND)
    assert "shaft.gap = 0.02200 rad is the bound" in finding.text
    assert "a smaller value" in finding.text
    assert Verdict.IDENTIFIED not in {one.verdict for one in found.estimates.values()}
    apart = {**made.model.unknowns, "shaft.gap": Unknown(0.018, bounds=(0.01, 0.04))}
    right = fit_network(replace(made.model, unknowns=apart), [made.recording])
    assert right.status is ModelStatus.VALID
