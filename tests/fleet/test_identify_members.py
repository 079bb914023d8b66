# SPDX-License-Identifier: MIT
"""Bus logs in a fleet: one result for each vehicle, from all its logs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from drivetwin.cli import main
from tests.fleet.toys import contents
from tests.support.bus_logs import RATIOS, write_log, write_ratio_card

VEHICLES = 6
ODD = "truck_4"


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two logs of each vehicle, all at 3 Hz but one; and the card of the ratios."""
    folder = tmp_path_factory.mktemp("trucks")
    for number in range(VEHICLES):
        vehicle = folder / f"truck_{number}"
        vehicle.mkdir()
        frequency = 4.0 if vehicle.name == ODD else 3.0 + 0.02 * number
        for seed in range(2):
            write_log(vehicle / f"run{seed}.csv", 10 * number + seed, frequency=frequency)
    write_ratio_card(folder)
    return folder


def _run(logs: Path, store: Path, *more: str, rules: str = RATIOS) -> int:
    command = ["fleet", str(logs), "--vehicle", str(logs / rules), "-o", str(store)]
    return main([*command, "--workers", "2", "--json", *more])


def _read_summary(capsys: pytest.CaptureFixture[str]) -> Any:
    return json.loads(capsys.readouterr().out.splitlines()[-1])


@pytest.fixture(scope="module")
def store(logs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("store") / "store"
    assert _run(logs, folder, "--reports") == 0
    return folder


def test_each_vehicle_has_one_result_of_all_its_logs(store: Path) -> None:
    found = contents(store)
    units = {one["log"]: one["unit"] for one in found["files"]}
    rows = {units[one["log"]]: one for one in found["rows"] if one["name"] == "f_d_2"}
    assert (len(found["files"]), len(rows)) == (2 * VEHICLES, VEHICLES)
    assert rows[ODD]["value"] == pytest.approx(4.0, abs=0.1)
    assert rows["truck_0"]["value"] == pytest.approx(3.0, abs=0.05)
    assert rows["truck_0"]["verdict"] == "identified"  # from one log alone it would be weak
    assert len(found["shifts"]) == 2 * VEHICLES
    assert {(one["start_gear"], one["end_gear"]) for one in found["shifts"]} == {("1", "2")}


def test_the_report_lists_vehicles_and_the_odd_one(
    store: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["fleet", "estimate", str(store), "--parameter", "f_d_2", "--json"]) == 0
    (one,) = json.loads(capsys.readouterr().out)["estimates"]
    (odd,) = [unit for unit in one["units"] if unit["odd"]]
    assert odd["unit"] == ODD
    assert abs(one["value"] + odd["deviation"] - 4.0) < 0.05
    assert one["spread_ci95"][0] > 0.1
    assert main(["fleet", "report", str(store), "--json"]) == 0
    page = Path(json.loads(capsys.readouterr().out)["report"]).read_text("utf-8")
    assert f"<h1>Fleet of {VEHICLES} units</h1>" in page
    for words in ("Vehicles of bus logs", "Units beyond what chance makes", ODD):
        assert words in page


def test_a_result_is_kept_until_the_logs_of_the_vehicle_change(
    logs: Path, store: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The key follows from the contents, wherever the files are and however many are equal."""
    copy = tmp_path / "copy" / "truck_0"
    copy.mkdir(parents=True)
    write_ratio_card(copy.parent)
    for name in ("run0.csv", "run1.csv"):
        (copy / name).write_bytes((logs / "truck_0" / name).read_bytes())
    for folder in (logs, copy.parent):
        assert _run(folder, store) == 0
        assert _read_summary(capsys)["computed"] == 0
    write_log(copy / "run2.csv", 2)
    (copy / "again.csv").write_bytes((copy / "run0.csv").read_bytes())
    assert _run(copy.parent, store) == 0
    assert _read_summary(capsys)["computed"] == 1
    found = contents(store)
    (log,) = {one["log"] for one in found["files"] if one["path"] == str(copy / "run2.csv")}
    assert sum(one["log"] == log for one in found["shifts"]) == 3  # an equal log counts once


def test_logs_of_one_name_are_told_apart_and_an_unreadable_one_is_left_out(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "vehicle"
    for day in ("monday", "tuesday"):
        (folder / day).mkdir(parents=True)
        write_log(folder / day / "run.csv", len(day))
    write_ratio_card(folder)
    rules = f'unit = "(vehicle)"\n[[rules]]\nvehicle = "{RATIOS}"\n'
    (folder / "rules.toml").write_text(rules, encoding="utf-8")
    assert _run(folder, tmp_path / "both", rules="rules.toml") == 0
    assert len(contents(tmp_path / "both")["shifts"]) == 2
    (folder / "tuesday" / "run.csv").write_text("no log\n", encoding="utf-8")
    _run(folder, tmp_path / "one", rules="rules.toml")
    found = contents(tmp_path / "one")
    assert len(found["shifts"]) == 1
    assert any("tuesday run.csv is left out" in row["reason"] for row in found["rows"])
    card = '[[gears]]\nname = "9"\nratio = 9.0\n'
    (folder / RATIOS).write_text(card, encoding="utf-8")
    (folder / "tuesday" / "run.csv").write_bytes((folder / "monday" / "run.csv").read_bytes())
    capsys.readouterr()
    _run(folder, tmp_path / "none", rules="rules.toml")
    summary = _read_summary(capsys)
    assert (summary["bad"], summary["computed"]) == (2, 1)
    (log,) = contents(tmp_path / "none")["logs"]
    assert (log["state"], log["error"]) == ("bad", "NoShiftError")
