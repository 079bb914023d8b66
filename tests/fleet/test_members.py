# SPDX-License-Identifier: MIT
"""Bus logs in a fleet: one result for each vehicle, from all its logs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from drivetwin.errors import FileFormatError
from drivetwin.estimation.result.method import DEFAULT_METHOD
from drivetwin.fleet.coordinator import FleetRun, run_fleet
from drivetwin.fleet.events import Event, Settled, Summary
from drivetwin.fleet.identify import identify_log
from drivetwin.fleet.index import FileRow
from drivetwin.fleet.mixed_model.estimate import estimate_fleet
from drivetwin.fleet.report import build_vehicle_section, save_fleet_report
from drivetwin.fleet.rows import RowKind
from drivetwin.fleet.rules import RulesFile, read_rules
from drivetwin.fleet.scan import Scan, Scanned
from drivetwin.fleet.sources import Sources, name_members
from drivetwin.fleet.store import Store
from drivetwin.fleet.task import State, Task
from drivetwin.report.blocks import TableBlock
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


def _run(logs: Path, store: Path, **changes: Any) -> tuple[Summary, list[Event]]:
    events: list[Event] = []
    request = FleetRun(
        sources=Sources([str(logs)]),
        rules=read_rules(logs / RATIOS),
        store=store,
        **{"workers": 2, "reports": True, "method": DEFAULT_METHOD, **changes},
    )
    return run_fleet(request, events.append), events


@pytest.fixture(scope="module")
def store(logs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("store") / "store"
    summary, _ = _run(logs, folder)
    assert (summary.done, summary.computed) == (2 * VEHICLES, VEHICLES)
    return folder


def test_each_vehicle_has_one_result_of_all_its_logs(store: Path) -> None:
    with Store(store) as opened:
        rows = opened.read_rows(RowKind.PARAMETER).to_pylist()
        units = dict(opened.index.select("SELECT log, unit FROM files"))
        shifts = list(opened.index.select("SELECT log, start_gear, end_gear FROM shifts"))
    found = {units[one["log"]]: one for one in rows if one["name"] == "f_d_2"}
    assert len(found) == VEHICLES
    assert found[ODD]["value"] == pytest.approx(4.0, abs=0.1)
    assert found["truck_0"]["value"] == pytest.approx(3.0, abs=0.05)
    assert found["truck_0"]["verdict"] == "identified"  # from one log alone it would be weak
    assert len(shifts) == 2 * VEHICLES
    assert {one[1:] for one in shifts} == {("1", "2")}


def test_nothing_is_computed_again(store: Path, logs: Path) -> None:
    summary, _ = _run(logs, store)
    assert (summary.done, summary.computed) == (2 * VEHICLES, 0)


def test_the_report_lists_vehicles_and_the_odd_one(store: Path, tmp_path: Path) -> None:
    with Store(store) as opened:
        (one,) = estimate_fleet(opened, ["f_d_2"])
        section = build_vehicle_section(opened, store)
        save_fleet_report(opened, tmp_path / "report.html")
    (odd,) = [unit for unit in one.units if unit.odd]
    assert odd.unit == ODD
    assert abs(one.value + odd.deviation - 4.0) < 0.05
    assert one.spread_ci95 is not None
    assert one.spread_ci95[0] > 0.1
    (table,) = section.blocks
    assert isinstance(table, TableBlock)
    frequencies = [row for row in table.rows if row[0].note == "f_d_2"]
    assert [row[1].text for row in frequencies] == [f"truck_{k}" for k in range(VEHICLES)]
    assert all((store / row[1].href).is_file() for row in frequencies)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Vehicles of bus logs" in page
    assert "Units beyond what chance makes" in page


def _scan(folder: Path) -> list[Scanned]:
    scan = Scan(read_rules(folder / RATIOS), DEFAULT_METHOD)
    nothing: dict[str, FileRow] = {}
    found = scan.scan_files(Sources([str(folder)]), nothing.get)
    return [one for one in found if isinstance(one, Scanned)]


def _make_vehicle(folder: Path) -> Path:
    """Two logs of one vehicle in two folders of the same file name."""
    for day in ("monday", "tuesday"):
        (folder / day).mkdir(parents=True)
        write_log(folder / day / "run.csv", len(day))
    write_ratio_card(folder)
    return folder


def _make_task(folder: Path) -> Task:
    unit = RulesFile(unit="(vehicle)", rules=read_rules(folder / RATIOS).rules)
    scan = Scan(unit, DEFAULT_METHOD)
    nothing: dict[str, FileRow] = {}
    first, second = scan.scan_files(Sources([str(folder)]), nothing.get)
    assert isinstance(first, Scanned)
    assert isinstance(second, Scanned)
    assert first.file.log == second.file.log
    assert first.recipe is not None
    file = first.file
    return Task(file.log, file.path, file.content, first.recipe, "x", members=first.members)


def test_the_key_follows_from_the_logs_of_the_vehicle(logs: Path, tmp_path: Path) -> None:
    before = {one.file.unit: one.file.log for one in _scan(logs)}
    assert len(set(before.values())) == VEHICLES
    copy = tmp_path / "copy" / "truck_0"
    copy.mkdir(parents=True)
    write_ratio_card(copy.parent)
    for name in ("run0.csv", "run1.csv"):
        (copy / name).write_bytes((logs / "truck_0" / name).read_bytes())
    assert {one.file.log for one in _scan(copy.parent)} == {before["truck_0"]}
    (copy / "again.csv").write_bytes((copy / "run0.csv").read_bytes())
    (again, *_) = _scan(copy.parent)
    assert len(again.members) == 2  # a log that is there twice counts once
    write_log(copy / "run2.csv", 2)
    assert before["truck_0"] not in {one.file.log for one in _scan(copy.parent)}


def test_logs_of_one_name_are_told_apart_and_a_task_crosses_a_pipe(tmp_path: Path) -> None:
    task = _make_task(_make_vehicle(tmp_path / "vehicle"))
    assert Task.from_json(task.to_json()) == task
    assert name_members([path for path, _ in task.members]) == ["monday run.csv", "tuesday run.csv"]
    found = identify_log(task)
    assert len(found.shifts) == 2


def test_a_log_that_cannot_be_read_leaves_the_others(tmp_path: Path) -> None:
    folder = _make_vehicle(tmp_path / "vehicle")
    (folder / "tuesday" / "run.csv").write_text("no log\n", encoding="utf-8")
    task = _make_task(folder)
    found = identify_log(task)
    assert len(found.shifts) == 1
    assert any("tuesday run.csv is left out" in row.reason for row in found.rows)
    changed = [(path, "0" * 64) for path, _ in task.members]
    with pytest.raises(FileFormatError, match="changed while the fleet was at work"):
        identify_log(replace(task, members=tuple(changed)))


def test_a_vehicle_without_a_gear_held_is_bad_with_all_its_logs(logs: Path, tmp_path: Path) -> None:
    folder = tmp_path / "vehicle"
    folder.mkdir()
    for name in ("run0.csv", "run1.csv"):
        (folder / name).write_bytes((logs / "truck_0" / name).read_bytes())
    card = '[[gears]]\nname = "9"\nratio = 9.0\n'
    (folder / RATIOS).write_text(card, encoding="utf-8")
    summary, events = _run(folder, tmp_path / "store")
    assert (summary.bad, summary.computed) == (2, 1)
    settled = [one for one in events if isinstance(one, Settled)]
    assert {one.state for one in settled} == {State.BAD}
    assert {one.error for one in settled} == {"NoShiftError"}
