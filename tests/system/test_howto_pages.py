# SPDX-License-Identifier: MIT
"""Commands and code of how-to pages and tutorials run as printed, from an empty folder."""

from __future__ import annotations

import importlib
import re
from pathlib import Path

import pytest

from drivetwin.authoring.element_questions import read_sensor_classes
from drivetwin.vehicle.card import load_card
from tests.support.bus_logs import BUS_LOGS, write_bus_logs
from tools.run_page import BLOCK, DOCS, find_outdated, run_line, run_page

HOWTO = DOCS / "howto"
TUTORIALS = sorted((DOCS / "tutorial").glob("*.md"))
SHIFT = ("synth -o shift.csv", "copy shift.card.toml truck.toml")
OUT = (*SHIFT, "identify shift.csv --vehicle truck.toml -o out")
RUNS = tuple(f"synth --seed {seed} -o run{seed}.csv" for seed in (1, 2, 3))
DAYS = tuple(f"synth -o {day}.mf4" for day in ("monday", "tuesday", "wednesday"))
SHORT = {
    "build-a-model.md": (),
    "check-a-card.md": (),
    "make-a-card.md": (),
    "reduce-a-gearbox.md": (),
}
LONG = {
    "controller-log.md": (),
    "compare.md": (
        *OUT,
        "copy out monday",
        "identify shift.csv --vehicle truck.toml --quick -o tuesday",
        "synth --seed 2 -o wednesday.csv",
    ),
    "drive.md": (),
    "examine.md": SHIFT,
    "export.md": OUT,
    "identify-your-own-driveline.md": (),
    "first-log.md": (*SHIFT, "synth --seed 2 -o other.csv"),
    "fleet.md": (*SHIFT, *(f"synth --seed {one} -o logs/unit_{one}/a.csv" for one in (1, 2))),
    "observe.md": (*OUT, "copy out/twin.toml twin.toml", "synth --seed 2 -o drive.csv"),
    "other-gearboxes.md": (),
    "paper-method.md": SHIFT,
    "several-logs.md": (*RUNS, *DAYS, "copy monday.card.toml truck.toml"),
    "synthetic-log.md": (),
}
"""Pages by name, with the commands that make the files which the page takes as given."""
WITHOUT_COMMANDS = ("install.md", "read-the-report.md", "workbench.md")
FRAGMENTS = ("bus-only.md", "many-runs.md", "notebook.md", "several-logs.md")
"""Pages with code that uses names of the reader; the notebooks of the examples run it whole."""
HOURS = ("calibrate.md", "own-controller.md", "try-a-controller.md")
"""Pages whose commands search for an hour; `tests/calibration` and `tests/cli` run shorter ones."""


@pytest.mark.parametrize("name", SHORT)
def test_a_short_page_runs(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run_page(HOWTO / name)
    if name == "make-a-card.md":
        assert load_card("truck.toml").sensors["output_torque"].gain > 0.0
        assert load_card("plain.toml").elements["C4"].gain.value == 0.03
        assert "# guess:" in Path("draft.toml").read_text(encoding="utf-8")


@pytest.mark.howto
@pytest.mark.parametrize("name", LONG)
def test_a_long_page_runs(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for line in LONG[name]:
        run_line(line)
    if name == "fleet.md":  # bus logs of vehicles
        write_bus_logs(tmp_path)
        for vehicle, log in enumerate(BUS_LOGS[:2]):
            (tmp_path / f"trucks/{vehicle}").mkdir(parents=True)
            (tmp_path / log).rename(tmp_path / f"trucks/{vehicle}/{log}")
    run_page(HOWTO / name, with_code=name not in FRAGMENTS)


@pytest.mark.howto
@pytest.mark.parametrize(
    "page",
    [
        pytest.param(page, marks=[pytest.mark.short] if page.stem == "bus-log" else [])
        for page in TUTORIALS
    ],
    ids=lambda page: page.stem,
)
def test_a_tutorial_prints_what_it_shows(
    page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    printed = run_page(page)
    assert find_outdated(page.read_text(encoding="utf-8"), printed) == []


def test_every_page_is_run_or_named() -> None:
    listed = {*SHORT, *LONG, *WITHOUT_COMMANDS, *FRAGMENTS, *HOURS}
    assert {page.name for page in HOWTO.glob("*.md")} == listed


@pytest.mark.parametrize("page", sorted(DOCS.rglob("*.md")), ids=lambda page: page.name)
def test_what_the_code_of_a_page_imports_exists(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    code = "".join(block["code"] or "" for block in BLOCK.finditer(text))
    for module, names in re.findall(r"^from (drivetwin\S*) import (\w[\w, ]*)$", code, re.M):
        for name in names.split(","):
            assert hasattr(importlib.import_module(module), name.strip()), (module, name)


def test_every_sensor_class_is_documented_with_its_source() -> None:
    text = (HOWTO / "make-a-card.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| `([\w-]+)` \| .* \| (.*) % \| .* \| \[(.*)\]\((.*)\) \|$", text, re.M)
    assert rows == [
        (name, f"{100 * one.gain_limit:g}", one.source, one.address)
        for name, one in read_sensor_classes().items()
    ]
