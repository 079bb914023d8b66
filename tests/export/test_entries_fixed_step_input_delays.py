# SPDX-License-Identifier: MIT
"""Delay lines of an exported model: sizes, descriptions, and the same delays in every form."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import fmpy
import numpy as np
import pytest

from drivetwin.export.c.loaded import CModel
from drivetwin.export.entries import InputDelays, Subject
from drivetwin.export.fmu.build import BuildOptions, Experiment, build_fmu
from drivetwin.export.targets import FmiVersion, InputKind
from tests.export.cases import (
    CASES,
    ON_A_PLATFORM_OF_FMI,
    STEP,
    Case,
    run_core,
    write_model,
)
from tests.export.fmu.test_build import Instance
from tests.export.modelica.compiled import run as run_modelica
from tests.support.arrays import FloatArray

OLD_TORQUE = InputDelays(0.0213, 0.0, as_logged=True, held=0.01)
EARLY_PRESSURE = InputDelays(0.004, -0.0092, as_logged=True)
LATE_PRESSURE = InputDelays(-0.003, 0.0452, as_logged=True)
ALL = (OLD_TORQUE, EARLY_PRESSURE, LATE_PRESSURE)


def _swing(name: str) -> Case:
    """A reference problem whose engine torque swings, so that its delay has an effect."""
    case = CASES[name]()
    swing = 200.0 * np.sin(2.0 * np.pi * 3.0 * case.time)
    return replace(case, inputs=case.inputs + np.outer(swing, [1.0, 0.0, 0.0]))


def _run_shifted(case: Case, delays: InputDelays, time: FloatArray) -> FloatArray:
    """Shaft torque (n,) of the core for inputs that were delayed before they were given."""
    lines = (delays.torque_line, delays.pressure_line, delays.pressure_line)
    columns = zip(case.inputs.T, lines, strict=True)
    inputs = np.column_stack([np.interp(time - line, case.time, u) for u, line in columns])
    subject = case.subject
    run = run_core(subject.model, subject.start, time, inputs, InputKind.LINEAR)
    assert run.status == "completed"
    return run.shaft_torque


@pytest.mark.parametrize("delays", ALL)
def test_c_delays_its_inputs(delays: InputDelays) -> None:
    """Steps shorter than a line's spacing are merged; steps of 10 ms are longer than a delay."""
    case = _swing("dual_clutch_upshift")
    model = CModel(replace(case.subject, delays=delays))
    fine = np.arange(0.0, 0.8, 1e-4)
    expected = _run_shifted(case, delays, fine)
    scale = np.abs(expected).max()
    rng = np.random.default_rng(1)
    uneven = np.cumsum(rng.uniform(2e-5, 2.5e-3, 600))
    uneven = np.append(0.0, uneven[uneven < fine[-1]])
    for time, tolerance in ((fine, 5e-4), (fine[::10], 5e-4), (uneven, 2e-3), (fine[::100], 2e-2)):
        inputs = np.column_stack([np.interp(time, case.time, u) for u in case.inputs.T])
        run = model.run(time, inputs)
        assert run.status == "completed"
        deviation = np.abs(run.columns["output_torque"] - np.interp(time, fine, expected)).max()
        assert deviation < tolerance * scale, time.size


def test_modelica_delays_its_inputs(tmp_path: Path) -> None:
    case, delays = _swing("dual_clutch_upshift"), LATE_PRESSURE
    first = int(np.argmax(np.abs(np.diff(case.inputs[:, 2])) > 0.0))
    time, inputs = case.time[: first + 150] - case.time[0], case.inputs[: first + 150]
    short = replace(case, time=time, inputs=inputs)
    experiment = Experiment("swing", time, inputs, STEP)
    text = write_model(replace(case.subject, delays=delays), experiment)
    found = -run_modelica(text, time, ("output_shaft.tau",), tmp_path)["output_shaft.tau"]
    late, early = (_run_shifted(short, one, time) for one in (delays, InputDelays()))
    scale = np.abs(late).max()
    assert np.abs(late - early).max() > 0.02 * scale
    assert np.abs(found - late).max() < 2e-3 * scale


@pytest.fixture(scope="module", params=list(FmiVersion))
def delayed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The upshift of the paper with delay lines, as an FMU."""
    case = _swing("dual_clutch_upshift")
    path = tmp_path_factory.mktemp("fmu") / "delayed.fmu"
    experiment = Experiment("upshift", case.time, case.inputs, STEP)
    build_fmu(_delay(case), path, BuildOptions(request.param, (), experiment))
    return path


def _delay(case: Case) -> Subject:
    return replace(case.subject, delays=LATE_PRESSURE)


@ON_A_PLATFORM_OF_FMI
def test_fmu_delays_its_inputs_and_saves_the_lines(delayed: Path) -> None:
    """A restored or reset instance goes on as one that never left."""
    case = _swing("dual_clutch_upshift")
    texts = {
        one.name: one.description
        for one in fmpy.read_model_description(str(delayed)).modelVariables
    }
    assert texts["engine_torque"].endswith("as logged, delayed by 0.003 s in the model")
    assert texts["B3.pressure"].endswith("as logged, delayed by 0.0452 s in the model")
    instance = Instance(delayed, fmpy.extract(str(delayed)))
    instance.initialize(case.inputs[0])
    begin = instance.run(case, 0, 600)
    saved = instance.fmu.getFMUState()
    packed = instance.fmu.serializeFMUState(saved)
    rest = instance.run(case, 600, 900)
    kind = InputKind.LINEAR if instance.is_fmi2 else InputKind.HOLD
    core = run_core(
        case.subject.model, case.subject.start, case.time, case.inputs, kind, LATE_PRESSURE
    )
    reported = np.concatenate((begin, rest))[:, 1]
    assert (
        np.abs(reported - core.shaft_torque[1:901]).max() < 1e-9 * np.abs(core.shaft_torque).max()
    )
    unpacked = instance.fmu.deserializeFMUState(packed)
    for state in (saved, unpacked):
        instance.fmu.setFMUState(state)
        assert np.array_equal(instance.run(case, 600, 900), rest)
        instance.fmu.freeFMUState(state)
    instance.fmu.reset()
    instance.initialize(case.inputs[0])
    assert np.array_equal(instance.run(case, 0, 600), begin)
    instance.free()


@ON_A_PLATFORM_OF_FMI
def test_inputs_first_set_after_initialization_have_no_history(delayed: Path) -> None:
    """Importers may leave inputs at zero until the first step: no clutch opens for that."""
    case = _swing("dual_clutch_upshift")
    instance = Instance(delayed, fmpy.extract(str(delayed)))
    instance.initialize(np.zeros(3))
    late = instance.run(case, 0, 20)
    instance.fmu.reset()
    instance.initialize(case.inputs[0])
    assert late == pytest.approx(instance.run(case, 0, 20), rel=1e-9)
    instance.free()
