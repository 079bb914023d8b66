# SPDX-License-Identifier: MIT
"""Every kind of shift and of gearbox, from the dynamometer through the program to its truth."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.cli import main
from drivetwin.cli.synth import write_run
from drivetwin.dyno import ScenarioName
from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.simulation.dual_clutch import FrictionTable, Stribeck
from tests.support.coverage import compute_bounds
from tests.support.repeats import mark_repeats

RATE = 500.0
"""Hz of the logger: less than usual, so that seven identifications take less time."""
KINDS = {
    ScenarioName.POWER_ON_DOWN: "power-on downshift",
    ScenarioName.POWER_OFF_UP: "power-off upshift",
    ScenarioName.POWER_OFF_DOWN: "power-off downshift",
    ScenarioName.INPUT_GEAR: "power-on upshift",
    ScenarioName.DUAL_CLUTCH: "power-on upshift",
    ScenarioName.MANUAL: "power-on upshift",
    ScenarioName.OPEN_CONVERTER: "power-on upshift",
}
KINDS_DAILY = (ScenarioName.POWER_ON_DOWN, ScenarioName.POWER_OFF_UP)
"""One with power and one without; the open converter has a test of its own below."""


@pytest.mark.parametrize("name", mark_repeats(KINDS, KINDS_DAILY), ids=str)
def test_truth_lies_in_the_intervals(
    name: ScenarioName, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = _slower(name, seed=0)
    log, card, truth_file = write_run(tmp_path / "log.csv", made)
    assert main(["identify", str(log), "--vehicle", str(card), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    truth = json.loads(truth_file.read_text())
    assert result["method"] == "likelihood"
    (shift,) = result["shifts"]
    assert shift["kind"] == KINDS[name]
    deviations = {}
    for key, known in truth["parameters"].items():
        found = result["parameters"][key]
        if found["std_total"]:
            assert found["verdict"] in ("identified", "weak", "design value"), key
            deviations[key] = (found["value"] - known["value"]) / found["std_total"]
    sizes = np.abs(list(deviations.values()))
    assert len(sizes) >= 10
    assert sizes.max() < 3.5, deviations
    assert np.count_nonzero(sizes < 1.96) >= compute_bounds(len(sizes))[0], deviations
    if name is ScenarioName.POWER_ON_DOWN:
        # B3 slips while the engine climbs: its friction is given beside that of B2, which differs.
        _holds(result["friction"]["B3"], made.truth.friction["B3"])


def _holds(curve: dict[str, list[float]], law: Stribeck | FrictionTable) -> None:
    slip, low, high = (np.array(curve[key]) for key in ("slip", "mu_lo", "mu_hi"))
    truth = law.evaluate(slip)
    assert np.mean((truth >= low) & (truth <= high)) > 0.6
    assert slip.max() > 80.0


def test_a_twin_of_an_open_converter_is_simulated_behind_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    log, card, _ = write_run(tmp_path / "log.csv", _slower(ScenarioName.OPEN_CONVERTER, seed=1))
    folder = tmp_path / "out"
    identify = ["identify", str(log), "--vehicle", str(card)]
    assert main([*identify, "-o", str(folder)]) == 0
    capsys.readouterr()
    assert main(["simulate", str(folder / "twin.toml"), str(log), "--json"]) == 0
    (shift,) = json.loads(capsys.readouterr().out)["shifts"]
    assert shift["fit"]["output_torque"]["all"]["fit_percent"] > 80.0
    card.write_text(card.read_text().partition("[converter]")[0])
    assert main([*identify, "--json"]) != 0
    assert "converter is open" in capsys.readouterr().out


def _slower(name: ScenarioName, seed: int) -> DynoRun:
    scenario = load_scenario(name)
    sensors = tuple(replace(s, rate=min(s.rate, RATE)) for s in scenario.sensors)
    return run(replace(scenario, sensors=sensors), seed=seed)
