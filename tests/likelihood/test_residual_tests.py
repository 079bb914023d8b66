# SPDX-License-Identifier: MIT
"""Residuals that speak against a model."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from drivetwin.findings import Code, Finding
from drivetwin.likelihood.residual_tests import check_residuals
from tests.estimation.likelihood.fixtures import bench, fitted, problem
from tests.support.arrays import FloatArray


def _list_correlated(fit: Any, error: FloatArray | float = 0.0) -> list[Finding]:
    """List findings where the output torque has an `error` in its noise."""
    (residual,) = fit.normal.residuals
    torque, wrong = fit.problem.terms[0].record.outputs[0], residual.copy()
    wrong[: torque.values.size] += torque.sigma * error
    found = check_residuals(
        replace(fit, normal=replace(fit.normal, residuals=(wrong,))), ["shift 2-3"]
    )
    return [one for one in found if one.code is Code.RESIDUAL_CORRELATED]


def test_a_residual_that_goes_with_an_input_or_with_time_is_named() -> None:
    """By its noise, and by the drift of a sensor of twice its noise."""
    fit = fitted()
    assert not _list_correlated(fit)
    (term,) = fit.problem.terms
    drive, torque = term.record.engine_torque, term.record.outputs[0]
    shown = np.interp(term.record.time[torque.place], drive.time, drive.values)
    plain = replace(term, weighting=problem(bench())[0].terms[0].weighting)
    (one,) = _list_correlated(
        replace(fit, problem=replace(fit.problem, terms=(plain,))),
        (shown - shown.mean()) / shown.std(),
    )
    assert ("shift 2-3", "output torque", "engine torque") in [cells[:3] for cells in one.cells]
    (one,) = _list_correlated(fit, np.linspace(-1.0, 1.0, torque.values.size))
    assert "sensor drift" in one.text
