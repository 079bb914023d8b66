# SPDX-License-Identifier: MIT
"""FMUs as importers see them: FMPy's checks, simulation, parameters, states, many instances."""

from __future__ import annotations

import re
import shutil
import subprocess
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

from drivetwin.errors import InputError
from drivetwin.export.fmu.build import BuildOptions, Experiment, build_fmu
from drivetwin.export.parameters.files import read_parameters
from drivetwin.export.targets import FmiVersion, InputKind, Platform
from tests.export.cases import (
    CASES,
    ON_A_PLATFORM_OF_FMI,
    STEP,
    Case,
    paper_subject,
    run_core,
)
from tests.support.arrays import FloatArray
from tests.support.repeats import mark_repeats

pytestmark = ON_A_PLATFORM_OF_FMI
INPUTS = ["engine_torque", "B2.pressure", "B3.pressure"]
SPEED, TORQUE, ONCOMING_TORQUE = "engine_speed", "output_torque", "B3.torque"


@dataclass(frozen=True)
class Built:
    """An FMU and the case behind it."""

    path: Path
    case: Case


@pytest.fixture(scope="module", params=list(FmiVersion))
def built(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Built:
    """The upshift of the paper with itself as experiment."""
    case = CASES["dual_clutch_upshift"]()
    path = tmp_path_factory.mktemp("fmu") / f"shift_{request.param.name}.fmu"
    build_fmu(case.subject, path, options(request.param, case))
    return Built(path, case)


def test_a_platform_without_a_place_in_the_version_is_refused(tmp_path: Path) -> None:
    """FMI 2.0 names no folder for macOS on ARM: the FMU would hold no binary at all."""
    path = tmp_path / "shift.fmu"
    with pytest.raises(InputError, match=r"FMI 2\.0 has no place for a binary of macos-arm"):
        build_fmu(paper_subject(), path, BuildOptions(platforms=(Platform.MACOS_ARM,)))
    assert not path.exists()


def options(version: FmiVersion, case: Case) -> BuildOptions:
    return BuildOptions(version, (), Experiment("upshift", case.time, case.inputs, STEP))


class Instance:
    """An instance of either version by FMPy's own binding; messages are collected."""

    def __init__(self, path: Path, folder: str, name: str = "one") -> None:
        description = fmpy.read_model_description(str(path))
        self.is_fmi2 = description.fmiVersion == "2.0"
        self.messages: list[str] = []
        self.references = {one.name: one.valueReference for one in description.modelVariables}
        self.references["unknown"] = 9999
        kind = FMU2Slave if self.is_fmi2 else FMU3Slave
        self.fmu = kind(
            guid=description.guid,
            unzipDirectory=folder,
            modelIdentifier=description.coSimulation.modelIdentifier,
            instanceName=name,
        )
        self._callbacks = self._fmi2_callbacks() if self.is_fmi2 else None
        self.instantiate()

    def instantiate(self) -> None:
        if self.is_fmi2:
            self.fmu.instantiate(callbacks=self._callbacks)
        else:
            self.fmu.instantiate(logMessage=self._log)

    def _fmi2_callbacks(self) -> object:
        from fmpy.fmi2 import fmi2CallbackFunctions, fmi2CallbackLoggerTYPE

        def log(*arguments: object) -> None:
            self.messages.append(str(arguments[-1]))

        callbacks = fmi2CallbackFunctions()
        callbacks.logger = fmi2CallbackLoggerTYPE(log)
        return callbacks

    def _log(self, *arguments: object) -> None:
        self.messages.append(str(arguments[-1]))

    def initialize(self, inputs: FloatArray) -> None:
        if self.is_fmi2:
            self.fmu.setupExperiment(startTime=0.0)
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=0.0)
        self.set(INPUTS, inputs)
        self.fmu.exitInitializationMode()

    def set(self, names: list[str], values: FloatArray | list[float]) -> None:
        setter = self.fmu.setReal if self.is_fmi2 else self.fmu.setFloat64
        setter([self.references[name] for name in names], [float(value) for value in values])

    def get(self, *names: str) -> list[float]:
        getter = self.fmu.getReal if self.is_fmi2 else self.fmu.getFloat64
        return list(getter([self.references[name] for name in names]))

    def run(self, case: Case, first: int, last: int) -> FloatArray:
        """Engine speed and output torque (n, 2) after each step; FMI 2.0 gets input rates."""
        rows = []
        for i in range(first, last):
            h = float(case.time[i + 1] - case.time[i])
            self.set(INPUTS, case.inputs[i])
            if self.is_fmi2:
                rates = (case.inputs[i + 1] - case.inputs[i]) / h
                inputs = [self.references[name] for name in INPUTS]
                self.fmu.setRealInputDerivatives(inputs, [1, 1, 1], [float(r) for r in rates])
            self.fmu.doStep(float(case.time[i]), h)
            rows.append(self.get(SPEED, TORQUE))
        return np.array(rows)

    def free(self) -> None:
        self.fmu.freeInstance()


@pytest.fixture
def instance(built: Built) -> Iterator[Instance]:
    folder = fmpy.extract(str(built.path))
    one = Instance(built.path, folder)
    yield one
    one.free()
    shutil.rmtree(folder, ignore_errors=True)


def test_inputs_with_their_rates_meet_the_tight_reference(built: Built, instance: Instance) -> None:
    """FMI 2.0 interpolates inputs; FMI 3.0, which has no such rates, holds them."""
    case = built.case
    subject = case.subject
    instance.initialize(case.inputs[0])
    reported = instance.run(case, 0, case.time.size - 1)
    kind = InputKind.LINEAR if instance.is_fmi2 else InputKind.HOLD
    core = run_core(subject.model, subject.start, case.time, case.inputs, kind)
    for column, expected in zip(reported.T, (core.engine_speed, core.shaft_torque), strict=True):
        assert np.abs(column - expected[1:]).max() < 1e-9 * np.abs(expected).max()
    if instance.is_fmi2:
        torque = np.concatenate([[core.shaft_torque[0]], reported[:, 1]])
        assert case.deviation(torque) < 1e-3


def test_a_state_saved_in_mid_shift_goes_on_the_same_way(built: Built, instance: Instance) -> None:
    case = built.case
    instance.initialize(case.inputs[0])
    instance.run(case, 0, 600)
    saved = instance.fmu.getFMUState()
    packed = instance.fmu.serializeFMUState(saved)
    first = instance.run(case, 600, 900)
    instance.fmu.setFMUState(saved)
    assert np.array_equal(instance.run(case, 600, 900), first)
    unpacked = instance.fmu.deserializeFMUState(packed)
    instance.fmu.setFMUState(unpacked)
    assert np.array_equal(instance.run(case, 600, 900), first)
    for state in (saved, unpacked):
        instance.fmu.freeFMUState(state)


def test_parameters_are_tuned_while_it_runs(built: Built, instance: Instance) -> None:
    case = built.case
    description = fmpy.read_model_description(str(built.path))
    by_name = {one.name: one for one in description.modelVariables}
    assert (by_name["k_o"].variability, by_name["k_o"].unit) == ("tunable", "N.m/rad")
    speed = by_name["start.engine_speed"]
    assert speed.displayUnit == "rpm"
    instance.initialize(case.inputs[0])
    before = instance.run(case, 0, 100)[-1, 1]
    assert instance.get("k_o") == [case.subject.model.k_o]
    instance.set(["k_o"], [2.0 * case.subject.model.k_o])
    assert instance.get("k_o") == [2.0 * case.subject.model.k_o]
    after = instance.run(case, 100, 101)[-1, 1]
    assert after > 1.5 * before


@pytest.mark.parametrize(
    ("reference", "value", "reported"),
    [
        ("k_o", -1.0, "parameter out of range: k_o"),
        ("start.engine_speed", float("nan"), "not a finite number"),
        ("unknown", 1.0, "value reference cannot be set"),
    ],
)
def test_bad_values_are_errors_with_a_message(
    built: Built, instance: Instance, reference: str, value: float, reported: str
) -> None:
    def start() -> None:
        instance.set([reference], [value])
        instance.initialize(built.case.inputs[0])

    with pytest.raises(FMICallException):
        start()
    assert any(reported in message for message in instance.messages)


def test_calls_out_of_order_are_errors_and_no_crash(built: Built, instance: Instance) -> None:
    case, fmu = built.case, instance.fmu
    with pytest.raises(FMICallException):
        fmu.doStep(0.0, 1e-3)
    assert any("needs an initialized instance" in message for message in instance.messages)
    instance.initialize(case.inputs[0])
    for step in (-1e-3, float("nan"), float("inf")):
        with pytest.raises(FMICallException):
            fmu.doStep(0.0, step)
    with pytest.raises(FMICallException):
        fmu.deserializeFMUState(b"no state")
    with pytest.raises(FMICallException):
        instance.set(["start.engine_speed"], [100.0])
    fmu.doStep(0.0, 0.0)
    assert instance.get(TORQUE) == pytest.approx([case.reference[0]], rel=1e-9)
    get = fmu.getInteger if instance.is_fmi2 else fmu.getInt64
    assert list(get([instance.references[f"{name}.mode"] for name in ("B2", "B3")])) == [1, 0]


def test_the_parameter_set_inside_names_what_can_be_tuned(built: Built, tmp_path: Path) -> None:
    with zipfile.ZipFile(built.path) as archive:
        archive.extract("resources/parameters.ssv", tmp_path)
    reported = read_parameters(tmp_path / "resources" / "parameters.ssv").scalars
    description = fmpy.read_model_description(str(built.path))
    tunable = {v.name: v for v in description.modelVariables if v.variability == "tunable"}
    assert {one.name: one.value for one in reported} == {
        name: float(variable.start) for name, variable in tunable.items()
    }


def _read_packed(path: Path, name: str) -> FloatArray:
    with zipfile.ZipFile(path) as archive:
        text = archive.read(f"extra/org.fmi-standard.fmi-ls-ref/{name}").decode()
    return np.genfromtxt(text.splitlines(), delimiter=",", skip_header=1)


def test_importers_that_set_values_only_meet_the_reference_inside(built: Built) -> None:
    """FMPy holds inputs over a step; so does the result named `measured_shift`."""
    stimulus = _read_packed(built.path, "measured_shift-in.csv")
    result = _read_packed(built.path, "measured_shift-ref.csv")
    names = ("time", "engine_torque", "B2.pressure", "B3.pressure")
    signals = np.array(
        [tuple(row) for row in stimulus.tolist()], dtype=[(name, float) for name in names]
    )
    reported = fmpy.simulate_fmu(
        str(built.path),
        start_time=stimulus[0, 0],
        stop_time=stimulus[-1, 0],
        step_size=STEP,
        output_interval=STEP,
        use_event_mode=False,
        input=signals,
        output=["engine_speed", "output_torque"],
        fmi_type="CoSimulation",
    )
    for column, expected in (("engine_speed", result[:, 1]), ("output_torque", result[:, 5])):
        assert np.abs(reported[column] - expected).max() < 1e-9 * np.abs(expected).max()


def test_sources_inside_are_complete(built: Built, tmp_path: Path) -> None:
    """What the description lists is what is there, and it compiles alone."""
    with zipfile.ZipFile(built.path) as archive:
        archive.extractall(tmp_path)
    folder = tmp_path / "sources"
    fmi3 = folder / "buildDescription.xml"
    text = (fmi3 if fmi3.exists() else tmp_path / "modelDescription.xml").read_text("utf-8")
    listed = re.findall(r'File name="([^"]+)"', text)
    assert sorted(listed) == sorted(path.name for path in folder.glob("*.c"))
    compiler = shutil.which("gcc") or shutil.which("cc")
    assert compiler is not None
    sources = [str(folder / name) for name in listed]
    command = [compiler, "-shared", "-fPIC", *sources, "-lm", "-o", str(tmp_path / "again.so")]
    subprocess.run(command, check=True)


@pytest.mark.parametrize("version", mark_repeats(FmiVersion, [FmiVersion.FMI3]))
@pytest.mark.parametrize(
    ("names", "expected"),
    [
        (("B 2's", "`Brémse α`\\"), (r"'B 2\'s'", "'_Bremse alpha_/'")),
        pytest.param(("Б", "В"), ("'?'", "'? 2'"), marks=pytest.mark.exhaustive),
        pytest.param(("load", "start"), ("load", "start"), marks=pytest.mark.exhaustive),
        pytest.param(("B" * 300, "1"), ("B" * 300, "'1'"), marks=pytest.mark.exhaustive),
    ],
)
def test_any_name_is_one_that_fmpy_accepts(
    tmp_path: Path, version: FmiVersion, names: tuple[str, str], expected: tuple[str, str]
) -> None:
    subject = CASES["tie_up"]().subject
    pairs = zip(subject.model.elements, names, strict=True)
    model = replace(subject.model, elements=tuple(replace(one, name=name) for one, name in pairs))
    start = replace(subject.start, locked=(names[0],))
    path = tmp_path / "named.fmu"
    named = replace(subject, model=model, start=start, name="twin of " * 1000)
    build_fmu(named, path, BuildOptions(version))
    assert validate_fmu(str(path)) == []
    reported = {one.name for one in fmpy.read_model_description(str(path)).modelVariables}
    assert {f"{name}.{end}" for name in expected for end in ("P0", "pressure", "slip")} <= reported
