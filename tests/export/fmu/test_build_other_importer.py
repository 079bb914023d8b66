# SPDX-License-Identifier: MIT
"""The FMU in a second importer: libcosim of the Open Simulation Platform, on the FMI Library."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivetwin.export.fmu.build import build_fmu
from drivetwin.export.targets import InputKind
from tests.export.cases import (
    CASES,
    ON_A_PLATFORM_OF_FMI,
    STEP,
    run_core,
)

pytestmark = ON_A_PLATFORM_OF_FMI
INPUTS, OUTPUTS = [1, 2, 3], [10, 14]
COARSE = 10
"""Steps of 10 ms: its threads wait for each other at every one."""


def test_libcosim_runs_it_as_the_core_does(tmp_path: Path) -> None:
    pytest.importorskip("libcosimpy", reason="libcosimpy is not installed")
    from libcosimpy.CosimExecution import CosimExecution
    from libcosimpy.CosimLogging import CosimLogLevel, log_output_level
    from libcosimpy.CosimManipulator import CosimManipulator
    from libcosimpy.CosimObserver import CosimObserver
    from libcosimpy.CosimSlave import CosimLocalSlave

    case = CASES["tie_up"]()
    time, given = case.time[::COARSE], case.inputs[::COARSE]
    path = tmp_path / "tie_up.fmu"
    build_fmu(case.subject, path)
    log_output_level(CosimLogLevel.ERROR)
    execution = CosimExecution.from_step_size(step_size=round(1e9 * STEP * COARSE))
    twin = execution.add_local_slave(CosimLocalSlave(str(path), "twin"))
    observer = CosimObserver.create_last_value()
    execution.add_observer(observer)
    inputs = CosimManipulator.create_override()
    execution.add_manipulator(inputs)
    for reference, value in zip(INPUTS, given[0].tolist(), strict=True):
        execution.real_initial_value(twin, reference, value)
    rows = []
    for row in given[:-1].tolist():
        inputs.slave_real_values(twin, INPUTS, row)
        assert execution.step()
        rows.append(observer.last_real_values(twin, OUTPUTS))
    subject = case.subject
    core = run_core(subject.model, subject.start, time, given, InputKind.HOLD)
    for reported, expected in zip(
        np.array(rows).T, (core.engine_speed, core.shaft_torque), strict=True
    ):
        assert np.abs(reported - expected[1:]).max() < 1e-9 * np.abs(expected).max()
