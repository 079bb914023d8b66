# SPDX-License-Identifier: MIT
"""`drivetwin export`: files appear, hold what the twin holds, and wrong input is refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drivetwin.cli import main
from drivetwin.export.parameters.content import Scalar
from drivetwin.export.parameters.files import ParameterFormat, read_parameters
from drivetwin.files.twin_file import save_twin
from tests.export.parameters.sample import twin


@pytest.fixture
def twin_file(tmp_path: Path) -> Path:
    path = tmp_path / "truck.toml"
    save_twin(path, twin())
    return path


@pytest.mark.parametrize("kind", ParameterFormat)
def test_parameter_file_holds_the_values_of_the_twin(
    kind: ParameterFormat, twin_file: Path, tmp_path: Path
) -> None:
    path = tmp_path / f"out.{kind}"
    assert main(["export", str(twin_file), "--to", kind.value, "-o", str(path)]) == 0
    k_o = read_parameters(path)["k_o"]
    assert isinstance(k_o, Scalar)
    assert (k_o.value, k_o.unit) == (1.76e5, "N*m/rad")


def test_names_converter_and_default_path(
    twin_file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    arguments = ["--to", "m", "--names", "simscape", "--powertrain", "truck-324kw", "--json"]
    assert main(["export", str(twin_file), *arguments]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["file"] == "truck.m"
    assert {"Aeff.B3", "mu_k.B3", "tc_capacity_factor"} <= set(told["parameters"])
    area = read_parameters(tmp_path / "truck.m")["Aeff_B3"]
    assert isinstance(area, Scalar)
    assert area.value == 2.7e-2


def test_what_the_log_could_not_tell_is_said(
    twin_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", str(twin_file), "--to", "dcm", "-o", str(tmp_path / "a.dcm")]) == 0
    assert "no value of te_delay" in capsys.readouterr().out


def test_a_damaged_twin_leaves_no_file(tmp_path: Path) -> None:
    damaged = tmp_path / "twin.toml"
    damaged.write_text("schema = 'other'", "utf-8")
    path = tmp_path / "out.ssv"
    assert main(["export", str(damaged), "--to", "ssv", "-o", str(path)]) == 2
    assert not path.exists()


def test_modelica_package_of_a_shift(twin_file: Path, tmp_path: Path) -> None:
    path = tmp_path / "truck.mo"
    arguments = ["--to", "modelica", "--shift", "2-3", "-o", str(path)]
    assert main(["export", str(twin_file), *arguments]) == 0
    text = path.read_text("utf-8")
    assert text.startswith('package sample_truck_2_3 "identified by the integral method')
    assert "Components.SpringDamper output_shaft(c=176000.0, d=280.0);" in text
