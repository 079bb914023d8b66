# SPDX-License-Identifier: MIT
"""What the virtual dynamometer writes is what the readers read."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.dyno.files import format_card, format_log, format_truth
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.logs.read import read_log
from drivetwin.vehicle.card import load_card


@pytest.fixture(scope="module")
def bench() -> DynoRun:
    return run(load_scenario("paper_steps"), seed=3)


def test_log_and_card_read_back(bench: DynoRun, tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text(format_log(bench), encoding="utf-8")
    (tmp_path / "card.toml").write_text(format_card(bench.scenario), encoding="utf-8")
    card = load_card(tmp_path / "card.toml")
    log = read_log(tmp_path / "run.csv", card)
    assert not log.findings
    for channel in bench.channels:
        if channel.role == "engine_torque":
            continue
        assert np.allclose(log[channel.role].values, channel.values, rtol=1e-8, atol=1e-3)
    assert log["engine_torque"].held


def test_held_torque_shows_each_value_for_one_can_period(bench: DynoRun) -> None:
    sent = next(c for c in bench.channels if c.role == "engine_torque")
    rows = np.array(
        [line.split(",")[1] for line in format_log(bench).splitlines()[2:]], dtype=float
    )
    assert np.array_equal(rows[:-1].reshape(-1, 10), np.repeat(sent.values[:-1, None], 10, axis=1))


def test_card_knows_the_design(bench: DynoRun, tmp_path: Path) -> None:
    (tmp_path / "card.toml").write_text(format_card(bench.scenario), encoding="utf-8")
    card = load_card(tmp_path / "card.toml")
    for element in bench.scenario.model.elements:
        assert card.get_clutch_ratios(element.name) == pytest.approx((element.i_c, element.i_out))
        assert card.elements[element.name].gain.value == element.gain
        assert card.elements[element.name].P0.value == pytest.approx(element.P0)
    assert card.final_drive.value == bench.scenario.model.i_f


def test_truth_file_names_parameters_with_units_and_the_run(bench: DynoRun) -> None:
    truth = json.loads(format_truth(bench))
    assert truth["parameters"]["J_vehicle"] == {"value": 6056.0, "unit": "kg*m^2"}
    assert truth["friction"]["B3"]["mu_c"] == 0.11
    assert truth["run"]["seed"] == 3
    assert truth["shifts"][0]["lockup"] == bench.truth.lockup
