# SPDX-License-Identifier: MIT
"""`drivetwin calibrate --controller`: the example of the how-to page, and faults of its code."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from drivetwin.cli import main
from drivetwin.export.parameters.files import read_parameters
from drivetwin.files.calibration_file import read_calibration_file
from drivetwin.files.twin_file import save_twin
from tests.calibration.twins import make_hydraulic_twin

SHORT = ("--draws", "60", "--engine-torque", "1400")

pytestmark = pytest.mark.usefixtures("quick_search")


@pytest.fixture
def own_controller(tmp_path: Path) -> Path:
    """Return the parameter file of the how-to page, with its source beside it."""
    source = Path(__file__).parents[2] / "docs" / "howto" / "own-controller"
    return Path(shutil.copytree(source, tmp_path / "own")) / "three_phase.toml"


def test_own_controller_is_calibrated(tmp_path: Path, own_controller: Path) -> None:
    save_twin(tmp_path / "twin.toml", make_hydraulic_twin())
    limits, out = tmp_path / "limits.toml", tmp_path / "out"
    limits.write_text("[limits]\nshift_time_s = 1.4\n")
    given = ["--controller", str(own_controller), "--limits", str(limits), "-o", str(out)]
    assert main(["calibrate", str(tmp_path / "twin.toml"), "--shift", "2-3", *given, *SHORT]) == 0
    content = read_calibration_file(out / "calibration.toml")
    assert content.policy == "own"
    assert "oncoming[0.2]" in content.parameters
    assert (out / "report.html").is_file()
    assert read_parameters(out / "calibration.dcm").scalars


def test_faults_of_the_own_controller_are_named(
    tmp_path: Path, own_controller: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    save_twin(tmp_path / "twin.toml", make_hydraulic_twin())
    source = own_controller.with_name("three_phase.c")
    text = source.read_text()
    source.write_text(
        text.replace(
            "if (in->time < 0.0)",
            "if (in->time > 0.5) *(volatile int *)0 = 1;\n    if (in->time < 0.0)",
        )
    )
    given = ["--controller", str(own_controller), "-o", str(tmp_path / "out")]
    assert main(["calibrate", str(tmp_path / "twin.toml"), "--shift", "2-3", *given, *SHORT]) == 2
    reported = " ".join(capsys.readouterr().err.split())
    for word in ("three_phase.c", "SIGSEGV", "time 0.5"):
        assert word in reported
    assert not (tmp_path / "out").exists()
