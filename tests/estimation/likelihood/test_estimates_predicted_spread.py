# SPDX-License-Identifier: MIT
"""Predicted distribution of measured less simulated signals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.estimation.likelihood.effects.correction import keep_fit
from drivetwin.estimation.likelihood.estimates import predict_spread
from tests.estimation.likelihood.fixtures import fitted


def test_samples_that_are_means_are_predicted_late_by_half_their_period() -> None:
    """The simulation is compared at the stamps, so the speed of the mean is that of the middle."""
    fit = fitted()
    (term,) = fit.problem.terms
    name = next(out.name for out in term.record.outputs if out.name != "output_torque")
    means = replace(term, record=term.record.select_modes({name}))
    run = term.simulate(fit.mean)
    assert run is not None
    averaged = replace(
        fit,
        problem=replace(fit.problem, terms=(means,)),
        normal=replace(fit.normal, residuals=(means.compute_residual(run),)),
    )
    key = "input_speed" if name == "engine_speed" else name
    (points,), (found,) = (predict_spread(one, keep_fit(one)) for one in (fit, averaged))
    time = found[key].time
    period = float(np.median(np.diff(time)))
    speed = run.engine_speed if key == "input_speed" else getattr(run, name)
    late = np.interp(time - 0.5 * period, run.time, speed) - np.interp(time, run.time, speed)
    assert points[key].mean == pytest.approx(0.0, abs=1e-6)
    moved = float(late @ found[key].mean) / float(late @ late)
    assert moved == pytest.approx(1.0, abs=0.05)
