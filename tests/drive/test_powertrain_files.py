# SPDX-License-Identifier: MIT
"""Powertrain files: all faults at once, built-in names, the suited one."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import pytest

from drivetwin.drive import list_builtin_powertrains, load_powertrain, select_powertrain
from drivetwin.errors import CardError
from drivetwin.gearbox import load_gearbox

TRUCK = files("drivetwin.drive").joinpath("powertrains", "truck-324kw.toml").read_text("utf-8")


@pytest.mark.parametrize("name", list_builtin_powertrains())
def test_built_in_files_load(name: str) -> None:
    assert load_powertrain(name).engine.lag > 0.0


def test_a_path_loads_like_a_name(tmp_path: Path) -> None:
    path = tmp_path / "own.toml"
    path.write_text(TRUCK, encoding="utf-8")
    assert load_powertrain(path) == load_powertrain("truck-324kw")


def test_grade_becomes_a_constant_torque(tmp_path: Path) -> None:
    path = tmp_path / "hill.toml"
    path.write_text(TRUCK.replace("grade = 0.0", "grade = 0.03"), encoding="utf-8")
    expected = 23747 * 9.81 * 0.5 * 0.03 / (1.0 + 0.03**2) ** 0.5
    assert load_powertrain(path).road.constant == pytest.approx(expected)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass_kg", "mass_t", "unknown key; did you mean 'mass_kg'"),
        ("lag_s = 0.20", "lag_s = 0.0", "greater than 0"),
        ("[600, 800,", "[800, 600,", "speed_rpm must increase"),
        ("[-150, -155,", "[-155,", "have as many entries"),
        ("[0.0, 0.1,", "[0.1, 0.0,", "speed_ratio must increase"),
        ("[1.8, 1.706,", "[1.8,", "go with the points of speed_ratio"),
    ],
)
def test_faults_are_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    path = tmp_path / "bad.toml"
    path.write_text(TRUCK.replace(old, new), encoding="utf-8")
    with pytest.raises(CardError, match=message):
        load_powertrain(path)


def test_an_unknown_name_lists_the_built_in_ones() -> None:
    with pytest.raises(CardError, match="did you mean 'truck-324kw'"):
        load_powertrain("truck-324")


def test_the_suited_engine_is_of_the_card_s_size() -> None:
    assert select_powertrain(load_gearbox("three-set-3000")) == "truck-324kw"
    assert select_powertrain(load_gearbox("gm-8l90")) == "car-350nm"
