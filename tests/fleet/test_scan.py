# SPDX-License-Identifier: MIT
"""From files to logs: what counts, what does not, and that a known file is not read again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from drivetwin.fleet import scan
from tests.fleet.toys import scan_files

RULE = '[[rules]]\nvehicle = "card.toml"\n'


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Two logs and a card."""
    for name in ("a.csv", "b.csv"):
        (tmp_path / name).write_text(f"time,x\ns,bar\n0,1\n1,{name!r}\n")
    (tmp_path / "card.toml").write_text("gears = 1\nelements = 1")
    return tmp_path


def _scan(folder: Path, known: Any = None, rules: str = RULE, seconds: float = 60.0) -> list[Any]:
    (folder / "rules.toml").write_text(rules)
    return scan_files(folder / "rules.toml", [str(folder / "*.csv")], known, seconds=seconds)


def test_a_file_that_did_not_change_is_not_read_again(folder: Path) -> None:
    known = {}
    for one in _scan(folder):
        known[one.file.path] = one.file
        object.__setattr__(one.file, "content", "as remembered")
    assert {one.file.content for one in _scan(folder, known)} == {"as remembered"}
    (folder / "a.csv").write_text("longer than it was before, and something else\n")
    contents = {Path(one.file.path).name: one.file.content for one in _scan(folder, known)}
    assert contents["a.csv"] != "as remembered"
    assert contents["b.csv"] == "as remembered"


def test_rules_look_into_the_file_and_a_wrong_field_is_its_fault(folder: Path) -> None:
    assert all(one.fault is None for one in _scan(folder, rules=f'{RULE}contains = ["x"]\n'))
    (misses, _) = _scan(folder, rules=f'{RULE}contains = ["y"]\n')
    assert misses.fault.error == "RulesError"
    field = "[fields.odometer]\npattern = '/(\\w)\\.csv'\n"
    faults = [one.fault for one in _scan(folder, rules=RULE + field)]
    assert all("odometer" in fault.what for fault in faults)
    assert all("longer than 0 s" in one.fault.what for one in _scan(folder, seconds=0.0))


def test_a_file_that_grows_or_vanishes_while_it_is_read(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compute = scan.Scan._compute_bounded_digest

    def change_first(self: Any, path: Path, size: int) -> str:
        digest = compute(self, path, size)
        if path.name == "a.csv":
            path.write_text("longer " * 1000)
        else:
            path.unlink()
        return digest

    monkeypatch.setattr(scan.Scan, "_compute_bounded_digest", change_first)
    first, second = (one.fault for one in _scan(folder))
    assert "changed while it was read" in first.what
    assert "cannot read the file" in second.what
