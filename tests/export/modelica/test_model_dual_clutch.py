# SPDX-License-Identifier: MIT
"""The exported dual clutch moves as the core's, in another compiler."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.export.entries import Subject
from drivetwin.export.fmu.build import Experiment
from drivetwin.export.modelica.model import format_modelica, write_modelica
from drivetwin.simulation.driveline_run import simulate
from drivetwin.simulation.dual_clutch import (
    DualClutch,
    FrictionTable,
    Signal,
    State,
    Stribeck,
)
from tests.export.modelica.compiled import run
from tests.export.parameters.sample import twin
from tests.report.sample import SHIFT

TABLE = FrictionTable((0.0, 5.0, 30.0, 90.0, 400.0), (0.14, 0.125, 0.118, 0.12, 0.13))
SLIPPING = State(220.0, 60.0, 60.0 / 5.38 - 0.1, 0.01)
SAMPLES = np.array([0.0, 0.05, 0.1, 0.2])
INPUTS = {
    "engine torque": Signal(SAMPLES, np.array([1500.0, 1400.0, 900.0, 950.0])),
    "B2": Signal(SAMPLES, np.array([2e5, 2.2e5, 1.8e5, 1.0e5])),
    "B3": Signal(SAMPLES, np.array([0.5e5, 2.5e5, 4e5, 4.1e5])),
}
VARIABLES = ("J1.w", "J_out.w", "J_v.w", "output_shaft.tau")


def _model(loss_law: Any = "paper") -> DualClutch:
    model = twin().build_dual_clutch(SHIFT)
    elements = tuple(replace(one, friction=TABLE, peak=1.2) for one in model.elements)
    return replace(model, loss_law=loss_law, elements=elements, J2e=1.5, i_in=1.1)


def _deviation(model: DualClutch, start: State, end: float, folder: Path) -> dict[str, float]:
    """Largest deviation of each variable from the core, relative to its largest value."""
    time = np.linspace(0.0, end, 101)
    pressures = {name: INPUTS[name] for name in ("B2", "B3")}
    ours = simulate(model, INPUTS["engine torque"], pressures, start, time)
    assert ours.status == "completed"
    text = format_modelica(Subject("truck 2-3", model, start), INPUTS, (0.0, end))
    theirs = run(text, time, VARIABLES, folder)
    expected = (ours.engine_speed, ours.output_speed, ours.wheel_speed, -ours.shaft_torque)
    return {
        name: float(np.abs(theirs[name] - value).max() / np.abs(value).max())
        for name, value in zip(VARIABLES, expected, strict=True)
    }


@pytest.mark.parametrize("loss_law", ["paper", "dissipative"])
def test_slipping_driveline_agrees_to_the_solvers_tolerance(loss_law: Any, tmp_path: Path) -> None:
    found = _deviation(_model(loss_law), SLIPPING, 0.2, tmp_path)
    assert max(found.values()) < 1e-6, found


@pytest.mark.parametrize("name", ["engine", "load", "B2 drum", "u_B2"])
def test_an_element_named_as_another_part_is_refused(name: str) -> None:
    """One of the two would be missing from the model, or what is declared twice not compile."""
    model = _model()
    off, on = (replace(one, drum_inertia=0.1) for one in model.elements)
    renamed = replace(model, elements=(off, replace(on, name=name)))
    with pytest.raises(InputError, match="would name two parts of the Modelica model"):
        format_modelica(Subject("truck 2-3", renamed, SLIPPING))


def test_a_fitted_law_is_followed_by_its_table(tmp_path: Path) -> None:
    model = _model()
    law = Stribeck(0.11, 0.135, 15.0, 1e-4)
    model = replace(model, elements=tuple(replace(e, friction=law) for e in model.elements))
    assert max(_deviation(model, SLIPPING, 0.2, tmp_path).values()) < 1e-4


def test_a_start_with_a_locked_element_is_without_slip(tmp_path: Path) -> None:
    model = _model()
    ratio = model.i_in * model.elements[0].i_c * model.elements[0].i_out
    start = State(150.0, 150.0 / ratio, 150.0 / ratio / 5.38, 0.013, ("B2",))
    inputs = {**INPUTS, "B2": Signal(SAMPLES, np.full(4, 1.4e6))}
    text = format_modelica(Subject("truck", model, start), inputs, (0.0, 0.02))
    found = run(text, np.linspace(0.0, 0.02, 21), ("B2.w_rel", "J1.w", "J_out.w"), tmp_path)
    assert found["B2.w_rel"][0] == pytest.approx(0.0, abs=1e-9)
    assert found["J1.w"][0] == pytest.approx(ratio * found["J_out.w"][0])
    # The stand-in for a stuck element creeps within its band.
    assert np.abs(found["B2.w_rel"]).max() < 2e-3


def test_an_experiment_becomes_the_run(tmp_path: Path) -> None:
    subject = Subject("truck", _model(), SLIPPING)
    columns = [signal.values for signal in INPUTS.values()]
    experiment = Experiment("shift 2-3", SAMPLES, np.column_stack(columns), 0.05)
    write_modelica(subject, experiment, tmp_path / "shift.mo")
    text = (tmp_path / "shift.mo").read_text("utf-8")
    assert text == format_modelica(subject, INPUTS, (0.0, 0.2))
    write_modelica(subject, None, tmp_path / "driveline.mo")
    assert (tmp_path / "driveline.mo").read_text("utf-8") == format_modelica(subject)
