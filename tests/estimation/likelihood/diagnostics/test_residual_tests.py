# SPDX-License-Identifier: MIT
"""What residuals say against a model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.estimation.likelihood.diagnostics.residual_tests import (
    check_residuals,
    check_weighting,
)
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.estimates import build_estimates
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.noise.residual_covariance import build_sensor_whitener
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.findings import Code, Finding
from tests.estimation.likelihood.fixtures import bench, fitted


def _list_correlated(fit: LikelihoodFit) -> list[Finding]:
    found = check_residuals(fit, ["shift 2-3"])
    return [one for one in found if one.code is Code.RESIDUAL_CORRELATED]


def test_a_residual_that_goes_with_an_input_speaks_against_every_value() -> None:
    fit = fitted()
    assert not _list_correlated(fit)
    (term,), (residual,) = fit.problem.terms, fit.normal.residuals
    drive = term.record.engine_torque
    torque = term.record.outputs[0]
    missing = np.zeros_like(residual)
    shown = np.interp(term.record.time[torque.place], drive.time, drive.values)
    missing[: torque.values.size] = torque.sigma * (shown - shown.mean()) / shown.std()
    plain = replace(
        fit.problem, terms=(replace(term, weighting=build_sensor_whitener(term.record.sigma)),)
    )
    wrong = replace(fit, problem=plain, normal=replace(fit.normal, residuals=(residual + missing,)))
    (one,) = _list_correlated(wrong)
    assert ("output torque", "engine torque") in [
        (row.names["channel"], row.names["source"]) for row in one.rows
    ]
    assert one.numbers["size"].value == max(abs(row.numbers["size"].value) for row in one.rows)
    assert one.heads[1:3] == ("Residual of", "Correlated with")
    assert ("shift 2-3", "output torque", "engine torque") in [cells[:3] for cells in one.cells]


def test_the_drift_of_a_sensor_speaks_against_every_value() -> None:
    """By twice its noise over the log."""
    fit = fitted()
    (term,), (residual,) = fit.problem.terms, fit.normal.residuals
    torque = term.record.outputs[0]
    drift = np.zeros_like(residual)
    drift[: torque.values.size] = torque.sigma * np.linspace(-1.0, 1.0, torque.values.size)
    drifted = replace(fit, normal=replace(fit.normal, residuals=(residual + drift,)))
    (one,) = _list_correlated(drifted)
    assert "sensor drift" in one.text
    assert "no listed effect" in one.text
    assert (
        "tyre slip" in check_residuals(drifted, ["2-3"], None, "tyre slip", "Slow down.")[-1].text
    )


def test_a_fit_that_leaves_out_the_noise_of_its_inputs_says_so() -> None:
    fit, made = fitted(), bench()
    assert check_weighting(fit, ["shift 2-3"]) == []
    (term,) = fit.problem.terms
    bare = replace(
        fit.problem, terms=(replace(term, weighting=build_sensor_whitener(term.record.sigma)),)
    )
    told = build_estimates(
        replace(fit, problem=bare), [made.signals], [made.driveline], {}, EffectPriors()
    )
    (one,) = [each for each in told.findings if each.code is Code.INPUT_NOISE_OMITTED]
    assert one.text.startswith("shift 2-3: ")
    assert all(one.verdict is not Verdict.IDENTIFIED for one in told.estimates.values())
    assert one.cause in told.estimates["k_o"].reason
