# SPDX-License-Identifier: MIT
"""Runs as fixed-step importers have them."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.export.fixed_step import Stepping, run_fixed_step, sample_signals
from drivetwin.export.targets import InputKind
from drivetwin.simulation.driveline_run import simulate
from drivetwin.simulation.dual_clutch import Signal
from tests.export.cases import CASES


def test_linear_inputs_are_those_of_the_core() -> None:
    case = CASES["dual_clutch_upshift"]()
    model, start = case.subject.model, case.subject.start
    torque, off, on = (Signal(case.time, np.ascontiguousarray(c)) for c in case.inputs.T)
    core = simulate(model, torque, {"B2": off, "B3": on}, start, case.time)
    run = run_fixed_step(model, start, case.time, case.inputs, InputKind.LINEAR)
    assert np.abs(run.shaft_torque - core.shaft_torque).max() < 0.1
    assert case.deviation(run.shaft_torque) < 1e-3


def test_held_inputs_lag_by_half_a_step() -> None:
    """To first order a held input is the linear one half a step later; the rest is of second."""
    case = CASES["dual_clutch_upshift"]()
    model, start = case.subject.model, case.subject.start
    held = run_fixed_step(model, start, case.time, case.inputs, InputKind.HOLD)
    shifted = np.maximum(case.time - 0.5e-3, 0.0)
    signals = (Signal(case.time, np.ascontiguousarray(c)) for c in case.inputs.T)
    late = sample_signals(tuple(signals), shifted)
    linear = run_fixed_step(model, start, case.time, late, InputKind.LINEAR)
    plain = run_fixed_step(model, start, case.time, case.inputs, InputKind.LINEAR)
    lag = np.abs(held.engine_speed - plain.engine_speed).max()
    assert np.abs(held.engine_speed - linear.engine_speed).max() < 0.1 * lag


def test_a_grid_ends_with_the_last_whole_step() -> None:
    assert Stepping(0.25e-1).build_grid(1.0, 1.11).tolist() == [1.0, 1.025, 1.05, 1.075, 1.1]


@pytest.mark.parametrize(
    ("step", "end"), [(0.0, 2.0), (float("nan"), 2.0), (1.0, 2.0), (0.1, 1.05)]
)
def test_impossible_steps_are_refused(step: float, end: float) -> None:
    with pytest.raises(InputError, match="step"):
        Stepping(step).build_grid(1.0, end)
