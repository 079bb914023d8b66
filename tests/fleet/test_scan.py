# SPDX-License-Identifier: MIT
"""From files to keys: what counts, what does not, and that a known file is not read again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from drivetwin.estimation.result.method import Method
from drivetwin.fleet.index import FileRow
from drivetwin.fleet.rules import FieldTable, RulesFile, RuleTable
from drivetwin.fleet.scan import Scan, Scanned, compute_settings_hash
from drivetwin.fleet.sources import Sources


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two logs and a card."""
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text(f"time,x\ns,bar\n0,1\n1,{name!r}\n")
    (tmp_path / "card.toml").write_text("gears = 1\nelements = 1")
    return tmp_path


def _scan(folder: Path, known: dict[str, FileRow] | None = None, **rule: object) -> list[Scanned]:
    table = RuleTable(name="r", vehicle=str(folder / "card.toml"), **rule)  # type: ignore[arg-type]
    scan = Scan(RulesFile(rules=[table]), Method.PAPER)
    found = list(scan.scan_files(Sources([str(folder)]), (known or {}).get))
    return [one for one in found if isinstance(one, Scanned)]


def test_keys_follow_from_content_and_settings_not_from_paths(folder: Path) -> None:
    first = _scan(folder)
    assert len({one.file.log for one in first}) == 2
    (folder / "b.csv").write_bytes((folder / "a.csv").read_bytes())
    again = _scan(folder)
    assert {one.file.log for one in again} == {first[0].file.log}
    (folder / "card.toml").write_text("gears = 2\nelements = 1")
    assert _scan(folder)[0].file.log != first[0].file.log


def test_every_part_of_a_recipe_counts_but_its_paths(folder: Path) -> None:
    recipe = _scan(folder)[0].recipe
    assert recipe is not None
    same = replace(recipe, vehicle="/elsewhere/card.toml")
    assert compute_settings_hash(same) == compute_settings_hash(recipe)
    for change in (
        {"method": Method.INTEGRAL},
        {"inputs": (("vehicle", "0"),)},
        {"version": "other"},
        {"means": (("oil", "TOil"),)},
        {"mu_slip": 40.0},
    ):
        assert compute_settings_hash(replace(recipe, **change)) != compute_settings_hash(recipe)


def test_a_file_that_did_not_change_is_not_read_again(folder: Path) -> None:
    known = {one.file.path: replace(one.file, content="as remembered") for one in _scan(folder)}
    assert {one.file.content for one in _scan(folder, known)} == {"as remembered"}
    (folder / "a.csv").write_text("longer than it was before, and something else\n")
    contents = {Path(one.file.path).name: one.file.content for one in _scan(folder, known)}
    assert contents["a.csv"] != "as remembered"
    assert contents["b.csv"] == "as remembered"


def test_rules_that_ask_for_channels_look_into_the_file(folder: Path) -> None:
    (fits, _) = _scan(folder, contains=["x"])
    assert fits.fault is None
    (misses, _) = _scan(folder, contains=["y"])
    assert misses.fault is not None
    assert misses.fault.error == "RulesError"


def test_a_field_that_is_no_number_is_the_logs_fault(folder: Path) -> None:
    rules = RulesFile(
        rules=[RuleTable(vehicle=str(folder / "card.toml"))],
        fields={"odometer": FieldTable(pattern=r"/(\w)\.csv")},
    )
    found = list(Scan(rules, Method.PAPER).scan_files(Sources([str(folder)]), lambda _: None))
    faults = [one.fault for one in found if isinstance(one, Scanned)]
    assert all(fault is not None and "odometer" in fault.what for fault in faults)


def test_a_file_that_grows_or_vanishes_while_it_is_read(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compute = Scan._compute_bounded_digest

    def change_first(self: Scan, path: Path, size: int) -> str:
        digest = compute(self, path, size)
        if path.name == "a.csv":
            path.write_text("longer " * 1000)
        else:
            path.unlink()
        return digest

    monkeypatch.setattr(Scan, "_compute_bounded_digest", change_first)
    first, second = (one.fault for one in _scan(folder))
    assert first is not None
    assert "changed while it was read" in first.what
    assert second is not None
    assert "cannot read the file" in second.what


def test_the_time_limit_covers_the_scan(folder: Path) -> None:
    rules = RulesFile(rules=[RuleTable(name="r", vehicle=str(folder / "card.toml"))])
    scan = Scan(rules, Method.PAPER, 0.0)
    for one in scan.scan_files(Sources([str(folder)]), lambda _: None):
        assert isinstance(one, Scanned)
        assert one.fault is not None
        assert "longer than 0 s" in one.fault.what
