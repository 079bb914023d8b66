# SPDX-License-Identifier: MIT
"""What the virtual dynamometer writes is what the readers read."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from drivetwin.cli import main
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from tests.support.bench import read_run


def test_log_and_card_read_back_and_a_slow_torque_is_held_in_each_row() -> None:
    bench = run(load_scenario("paper_steps"), seed=3)
    log, card = read_run(bench)
    assert not log.findings
    for channel in bench.channels:
        if channel.role == "engine_torque":
            continue
        assert np.allclose(log[channel.role].values, channel.values, rtol=1e-8, atol=1e-3)
    torque = next(one for one in bench.channels if one.role == "engine_torque")
    assert log["engine_torque"].held
    assert np.interp(torque.time, log["engine_torque"].time, log["engine_torque"].values) == (
        pytest.approx(torque.values, abs=1e-3)
    )
    for element in bench.scenario.model.elements:
        assert card.get_clutch_ratios(element.name) == pytest.approx((element.i_c, element.i_out))
        assert card.elements[element.name].gain.value == element.gain
        assert card.elements[element.name].P0.value == pytest.approx(element.P0)
    assert card.final_drive.value == bench.scenario.model.i_f


def test_a_log_by_command_has_its_truth_with_units_beside_it(tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    assert main(["synth", "--scenario", "paper_steps", "--seed", "3", "-o", str(file)]) == 0
    truth = json.loads(file.with_suffix(".truth.json").read_text(encoding="utf-8"))
    assert truth["parameters"]["J_vehicle"] == {"value": 6056.0, "unit": "kg*m^2"}
    assert truth["friction"]["B3"]["mu_c"] == 0.11
    assert truth["run"]["seed"] == 3
    assert truth["shifts"][0]["lockup"] > truth["shifts"][0]["inertia_start"]


def test_the_card_of_a_manual_gearbox_maps_one_column_to_both_elements() -> None:
    log, card = read_run(run(load_scenario("manual")))
    assert {log[f"pressure.{name}"].source_name for name in card.elements} == {"PrsClutch"}
    ratios = [gear.ratio.value for gear in card.gears]
    assert ratios == sorted(ratios, reverse=True)
