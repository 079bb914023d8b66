# SPDX-License-Identifier: MIT
"""`drivetwin export`: files appear, hold what the twin holds, and wrong input is refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from drivetwin.cli import main
from drivetwin.export.parameters.content import Scalar
from drivetwin.export.parameters.files import read_parameters
from drivetwin.files.twin_file import save_twin
from tests.export.parameters.sample import twin


@pytest.fixture
def twin_file(tmp_path: Path) -> Path:
    path = tmp_path / "truck.toml"
    save_twin(path, twin())
    return path


def test_names_and_default_path(
    twin_file: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    arguments = ["--to", "m", "--names", "simscape", "--json"]
    assert main(["export", str(twin_file), *arguments]) == 0
    reported = json.loads(capsys.readouterr().out)
    assert reported["file"] == "truck.m"
    assert {"Aeff.B3", "mu_k.B3"} <= set(reported["parameters"])
    area = read_parameters(tmp_path / "truck.m")["Aeff_B3"]
    assert isinstance(area, Scalar)
    assert area.value == 2.7e-2
