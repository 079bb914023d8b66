# SPDX-License-Identifier: MIT
"""Runs as fixed-step importers have them."""

from __future__ import annotations

import numpy as np

from drivetwin.export.targets import InputKind
from drivetwin.simulation.driveline_run import simulate
from drivetwin.simulation.dual_clutch import Signal
from tests.export.cases import CASES, run_core


def test_linear_inputs_are_those_of_the_core() -> None:
    case = CASES["dual_clutch_upshift"]()
    model, start = case.subject.model, case.subject.start
    torque, off, on = (Signal(case.time, np.ascontiguousarray(c)) for c in case.inputs.T)
    core = simulate(model, torque, {"B2": off, "B3": on}, start, case.time)
    run = run_core(model, start, case.time, case.inputs, InputKind.LINEAR)
    assert np.abs(run.shaft_torque - core.shaft_torque).max() < 0.1
    assert case.deviation(run.shaft_torque) < 1e-3
