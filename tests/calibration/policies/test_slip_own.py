# SPDX-License-Identifier: MIT
"""The user's controller in C: the built-in slip policy written in it, and faults of its code."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivetwin.calibration.guarded_controller import run_guarded
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.options import PolicyKind
from drivetwin.calibration.policies.slip import HEADER
from drivetwin.errors import ControllerError
from drivetwin.export.compiler import compile_library
from drivetwin.simulation.shift_control import ExternalController, ShiftController
from tests.calibration.cases import draw, make_plant, make_task, start

FIELDS = (
    *("fill_pressure", "fill_time", "kiss_pressure", "torque_phase_time", "handover_pressure"),
    *("hold_time", "hold_pressure", "release_time", "inertia_pressure", "sync_pressure"),
    *("inertia_time", "end_slope", "gain", "integral_gain", "lock_rate", "lock_lead"),
    *("reduction_depth", "reduction_delay", "reduction_time", "return_slip", "return_time"),
    *("task", "direction"),
)
"""Parameters of slip.c in their order."""


def build(folder: Path, source: str) -> Path:
    """Compile C text against the header."""
    path = folder / "controller.c"
    path.write_text(source)
    library = folder / "controller.so"
    compile_library([path], library, None, headers=[HEADER.parent])
    return library


@pytest.fixture(scope="module")
def slip_library(tmp_path_factory: pytest.TempPathFactory) -> Path:
    source = (Path(__file__).parent / "slip.c").read_text()
    return build(tmp_path_factory.mktemp("slip"), source)


def to_external(given: ShiftController, library: Path) -> ExternalController:
    """Return slip.c with the parameters of a built-in controller."""
    return ExternalController(
        given.offgoing,
        given.oncoming,
        given.task,
        given.request,
        given.engine_torque,
        given.system_pressure,
        353.0,
        tuple(getattr(given, name) for name in FIELDS),
        library,
    )


def evaluate(
    library: Path, external: bool
) -> dict[Metric, np.ndarray[tuple[int], np.dtype[np.float64]]]:
    task = make_task(policy=PolicyKind.SLIP)
    control: Any = start(task)
    if external:
        control = replace(control, controller=to_external(control.controller, library))
    return dict(make_plant(task.maneuver).evaluate(control, draw(task, 12)).values)


def test_slip_policy_in_c_equals_the_built_in_one(slip_library: Path) -> None:
    built_in, external = (evaluate(slip_library, one) for one in (False, True))
    for metric, values in built_in.items():
        np.testing.assert_allclose(external[metric], values, rtol=1e-9, atol=1e-12)


STEP = """#include "drivetwin_controller.h"
#include <math.h>
size_t dt_state_size(void) {{ return 0; }}
void dt_step(const double *p, void *s, const dt_inputs *in, dt_commands *out) {{
    (void)p; (void)s;
    if (in->time > 0.3) {{ {fault} }}
}}
"""


@pytest.mark.parametrize(
    ("fault", "text"),
    [
        ("for (volatile int k = 1; k;) {}", r"not returned.*time 0\.3"),
        ("out->oncoming_pressure = NAN;", r"not finite at 0\.4.*slips"),
    ],
)
def test_faults_name_the_task_and_its_inputs(
    tmp_path: Path, fault: str, text: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("drivetwin.calibration.guarded_controller.LONGEST_CALL", 1.0)
    library = build(tmp_path, STEP.format(fault=fault))
    with pytest.raises(ControllerError, match=text):
        run_guarded(library, evaluate, library, True)
