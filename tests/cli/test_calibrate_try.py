# SPDX-License-Identifier: MIT
"""`drivetwin try`: a right controller, six planted bugs, comparison, faults of code and files."""

from __future__ import annotations

import json
import re
import shutil
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest

from drivetwin.cli import main
from drivetwin.files.twin_file import save_twin
from tests.calibration.twins import make_hydraulic_twin

SOURCES = Path(__file__).with_name("own_controllers")


@pytest.fixture
def controller(tmp_path: Path) -> Path:
    """Return the parameter file of a right controller, with a twin beside it."""
    save_twin(tmp_path / "twin.toml", make_hydraulic_twin())
    return Path(shutil.copytree(SOURCES, tmp_path / "own")) / "regulator.toml"


def edit(path: Path, old: str, new: str) -> Path:
    """Write a copy of a file with another text in place of the first `old`."""
    copy = path.with_name(f"edited_{path.name}")
    assert old in path.read_text()
    copy.write_text(path.read_text().replace(old, new, 1))
    return copy


def run(controller: Path, *given: str) -> int:
    """Run the command on the twin beside the controller's folder."""
    twin = controller.parents[1] / "twin.toml"
    return main(["try", str(twin), "--shift", "2-3", "--controller", str(controller), *given])


def list_failures(folder: Path) -> set[tuple[str, str]]:
    """List suite and case of the failures in the JUnit file of a run."""
    root = ET.parse(folder / "junit.xml").getroot()
    return {
        (suite.get("name", ""), case.get("name", ""))
        for suite in root
        for case in suite
        if len(case)
    }


def write_scenarios(folder: Path, text: str) -> Path:
    path = folder / "scenarios.toml"
    path.write_text(text)
    return path


def test_a_failure_has_the_unit_at_both_numbers(tmp_path: Path, controller: Path) -> None:
    bounds = "{ friction_energy_J = 1000.0, friction_energy_of_nominal = 0.5 }"
    text = f'[[scenarios]]\nname = "one"\ndraws = 1\nassert = {bounds}\n'
    scenarios = write_scenarios(tmp_path, text)
    assert run(controller, "--scenarios", str(scenarios), "-o", str(tmp_path / "out")) == 1
    junit = (tmp_path / "out" / "junit.xml").read_text()
    assert re.search(r"friction_energy_J: [\d.]+ kJ in run 0, above 1 kJ \(1 of 1 runs\)", junit)
    assert re.search(r"friction_energy_of_nominal: [\d.]+ kJ in run 0, above [\d.]+ kJ", junit)


def test_a_right_controller_passes_the_stock_scenarios(
    tmp_path: Path, controller: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert run(controller, "-o", str(tmp_path / "out"), "--json") == 0
    assert list_failures(tmp_path / "out") == set()
    assert "Worst runs" in (tmp_path / "out" / "report.html").read_text()
    found = {one["scenario"]: one for one in json.loads(capsys.readouterr().out)["scenarios"]}
    worst: Any = {
        name: {check["key"]: check["worst"] for check in one["checks"]}
        for name, one in found.items()
    }
    # Conditions and faults act: a light vehicle jerks more, a controller without a slip signal
    # waits for its time limit, and a lost intervention makes the shift longer.
    nominal = worst["nominal"]
    assert worst["light vehicle"]["peak_jerk_of_nominal"] > 1.3 * nominal["peak_jerk_of_nominal"]
    assert worst["torque request lost"]["torque_reduction_of_torque"] < 1.0
    assert worst["torque request lost"]["shift_time_s"] > nominal["shift_time_s"]
    assert worst["late speeds"]["shift_time_s"] != nominal["shift_time_s"]
    assert worst["request after 65.2 s"]["peak_jerk_change"] < 1e-9


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        pytest.param(1, ("nominal", "unfinished"), id="sign of a ramp"),
        pytest.param(2, ("nominal", "torque_reduction_of_torque"), id="missing clamp"),
        pytest.param(3, ("request after 2.2 s", "unlocked"), id="counter that overflows"),
        pytest.param(4, ("cold oil", "flare_rad_s"), id="unit of the temperature"),
        pytest.param(5, ("nominal", "unfinished"), id="race of two flags"),
        pytest.param(6, ("request after 4.8 s", "peak_jerk_change"), id="integrator not reset"),
    ],
)
def test_the_stock_scenarios_find_a_planted_bug(
    fault: int, expected: tuple[str, str], tmp_path: Path, controller: Path
) -> None:
    faulty = edit(controller, "task_s", f'defines = ["FAULT={fault}"]\ntask_s')
    assert run(faulty, "--draws", "2", "-o", str(tmp_path / "out")) == 1
    assert expected in list_failures(tmp_path / "out")


def test_a_difference_of_three_percent_is_found(
    tmp_path: Path, controller: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    nominal = write_scenarios(tmp_path, '[[scenarios]]\nname = "nominal"\n')
    given = ("--scenarios", str(nominal), "--draws", "64", "--json")
    other = edit(controller, 'name = "inertia"\nunit = "bar/Nm"\nstart = 0.0037',
                 'name = "inertia"\nunit = "bar/Nm"\nstart = 0.0038')  # fmt: skip
    assert run(controller, "--against", str(other), *given) == 0
    rows = json.loads(capsys.readouterr().out)["differences"]
    jerk = next(one for one in rows if one["metric"] == "peak_jerk")
    share = jerk["second"] / jerk["first"] - 1.0
    assert 0.025 < share < 0.04
    assert jerk["p"] < 0.05
    assert 0.02 < jerk["low"] / jerk["first"] < share < jerk["high"] / jerk["first"] < 0.04
    assert run(controller, "--against", str(controller), *given) == 0
    rows = json.loads(capsys.readouterr().out)["differences"]
    assert all(one["p"] == 1.0 for one in rows)


@pytest.mark.parametrize("task", [0.001, 0.02])
def test_tasks_from_1_to_20_ms(task: float, tmp_path: Path, controller: Path) -> None:
    scenarios = write_scenarios(
        tmp_path, 'assert = { unfinished = 0 }\n[[scenarios]]\nname = "nominal"\n'
    )
    own = edit(controller, 'unit = "s"\nstart = 0.01', f'unit = "s"\nstart = {task}')
    given = ("--task", str(task), "--scenarios", str(scenarios), "--draws", "2")
    assert run(own, *given) == 0


def test_a_crash_fails_its_scenario_alone(tmp_path: Path, controller: Path) -> None:
    source = controller.with_name("regulator.c")
    text = source.read_text().replace(
        "    s->ticks++;",
        "    if (in->oil_temperature < 300.0) *(volatile int *)0 = 1;\n    s->ticks++;",
    )
    source.write_text(text)
    scenarios = write_scenarios(
        tmp_path,
        'assert = { unlocked = 0 }\n[[scenarios]]\nname = "nominal"\n'
        '[[scenarios]]\nname = "cold"\noil_C = -10.0\n',
    )
    out = tmp_path / "out"
    assert run(controller, "--scenarios", str(scenarios), "--draws", "2", "-o", str(out)) == 1
    assert list_failures(out) == {("cold", "runs")}
    assert "SIGSEGV" in (out / "junit.xml").read_text()


def test_faults_of_files_and_code_are_named(
    tmp_path: Path, controller: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scenarios = write_scenarios(
        tmp_path,
        'assert = { peak_jrk_m_s3 = 3.0 }\n[[scenarios]]\nname = "nominal"\nmas = 2.0\n',
    )
    assert run(controller, "--scenarios", str(scenarios)) == 2
    reported = capsys.readouterr().err
    assert "scenarios[0].mas" in reported
    write_scenarios(tmp_path, 'assert = { peak_jrk = 3.0 }\n[[scenarios]]\nname = "nominal"\n')
    assert run(controller, "--scenarios", str(scenarios)) == 2
    assert "assert.peak_jrk" in capsys.readouterr().err
    missing = edit(controller, '"parts/ramps.c"', '"parts/slopes.c"')
    assert run(missing) == 2
    assert "slopes.c is no file" in " ".join(capsys.readouterr().err.split())
    source = controller.with_name("regulator.c")
    source.write_text(source.read_text().replace("s->ticks++;", "s->ticks++"))
    assert run(controller) == 2
    reported = " ".join(capsys.readouterr().err.split())
    assert "error: expected" in reported
    assert "correct the C source" in reported
