# SPDX-License-Identifier: MIT
"""Logs of a gearbox control with missing numbers give their other shifts, or the reason."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivetwin.cli import main
from drivetwin.errors import MappingError, NoShiftError, PlausibilityError
from drivetwin.tcu.card import load_controller_card
from drivetwin.tcu.log import REFERENCE_OIL, ControllerLog, read_controller_log
from drivetwin.tcu.outcome import identify_controller
from drivetwin.tcu.statements import find_onset


def _write(folder: Path) -> Path:
    path = folder / "control.csv"
    assert main(["synth", "--scenario", "controller_log", "-o", str(path)]) == 0
    return path


def _load(path: Path) -> ControllerLog:
    return read_controller_log(path, load_controller_card(path.with_suffix(".card.toml")))


def _read(folder: Path, column: str, begin: float, end: float, cell: str = "NaN") -> ControllerLog:
    """Read a made log with a `cell` in a column from `begin` to `end` [s], by default no number."""
    path = _write(folder)
    names, units, *rows = (line.split(",") for line in path.read_text("utf-8").splitlines())
    for row in rows:
        if begin <= float(row[0]) < end:
            row[names.index(column)] = cell
    text = "\n".join(",".join(row) for row in (names, units, *rows)) + "\n"
    path.write_text(text, "utf-8")
    return _load(path)


def test_a_shift_whose_command_is_missing_is_left_out_with_its_channel(tmp_path: Path) -> None:
    log = _read(tmp_path, "p_K1_cmd", 1.5, 1.7)
    assert log.left_out == ("1.00 s, 1-2: missing or damaged numbers of pressure_command.K1",)
    assert len(log.shifts) == 11


@pytest.mark.parametrize(("column", "cell"), [("n_output", "16383"), ("n_turbine", "0")])
def test_a_speed_that_spikes_or_drops_out_is_no_measured_one(
    tmp_path: Path, column: str, cell: str
) -> None:
    log = _read(tmp_path, column, 1.99, 2.03, cell)
    role = {"n_output": "output_speed", "n_turbine": "input_speed"}[column]
    assert log.left_out == (f"1.00 s, 1-2: missing or damaged numbers of {role}",)


def test_a_command_that_does_not_change_in_its_shift_is_named(tmp_path: Path) -> None:
    with pytest.raises(NoShiftError) as refusal:
        _read(tmp_path, "gear_target", 0.0, 1e9, "1")
    assert "never changes" in refusal.value.what
    log = _read(tmp_path, "p_K2_cmd", 0.0, 1e9, "0")
    assert {one.kind for one in log.shifts} == {"1-2", "3-4"}
    assert "31.00 s, 2-3: the command of K2 does not change" in log.left_out


def test_commands_in_another_unit_are_refused_with_the_unit_that_fits(tmp_path: Path) -> None:
    path = _write(tmp_path)
    path.write_text(path.read_text("utf-8").replace("mbar", "bar"), "utf-8")
    with pytest.raises(PlausibilityError, match="above 100") as refusal:
        _load(path)
    assert 'unit = "hPa"' in refusal.value.remedy


def test_a_command_in_too_small_a_unit_is_refused_before_the_fit(tmp_path: Path) -> None:
    path = _write(tmp_path)
    path.write_text(path.read_text("utf-8").replace("mbar", "Pa"), "utf-8")
    card = load_controller_card(path.with_suffix(".card.toml"))
    with pytest.raises(PlausibilityError, match=r"K1 applies at 0\.\d+ bar, where the card"):
        identify_controller([path], card)


@pytest.mark.parametrize(
    ("first", "second"),
    [("n_turbine", "n_output"), ("n_engine", "n_turbine"), ("n_engine", "n_output")],
)
def test_swapped_speeds_are_refused_with_the_columns_that_fit(
    tmp_path: Path, first: str, second: str
) -> None:
    path = _write(tmp_path)
    names, rest = path.read_text("utf-8").split("\n", 1)
    swapped = {first: second, second: first}
    head = ",".join(swapped.get(name, name) for name in names.split(","))
    path.write_text(f"{head}\n{rest}", "utf-8")
    with pytest.raises(MappingError, match="speeds are swapped") as refusal:
        _load(path)
    roles = {"n_engine": "engine_speed", "n_turbine": "input_speed", "n_output": "output_speed"}
    for name, role in roles.items():
        line = f'channels.{role} = {{ source = "{swapped.get(name, name)}" }}'
        assert line in refusal.value.remedy


@pytest.mark.parametrize("end", [1.7, 1e9])
def test_a_missing_oil_temperature_is_that_of_the_other_rows_or_the_usual_one(
    tmp_path: Path, end: float
) -> None:
    log = _read(tmp_path, "T_oil", 0.5, end)
    assert log.left_out == ()
    assert (log.shifts[-1].oil == REFERENCE_OIL) is (end > 1e3)
    assert 30.0 < log.shifts[0].oil < 90.0


def test_a_pressure_that_never_exceeds_p0_has_no_onset() -> None:
    time = np.linspace(0.0, 1.0, 11)
    assert np.isnan(find_onset(time, time - 2.0))
    assert find_onset(time, time - 0.55) == pytest.approx(0.55)
