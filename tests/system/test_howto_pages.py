# SPDX-License-Identifier: MIT
"""Commands and code of how-to pages run as printed, from an empty folder and in their order."""

from __future__ import annotations

import importlib
import re
import shlex
import shutil
from pathlib import Path

import pytest

from drivetwin.authoring.sensor_classes import read_sensor_classes
from drivetwin.cli import main
from drivetwin.vehicle.card import load_card

DOCS = Path(__file__).resolve().parents[2] / "docs"
HOWTO = DOCS / "howto"
BLOCK = re.compile(
    r"^(?: {4,}drivetwin (?P<line>[^\n]*)|```python\n(?P<code>.*?)^```)$", re.M | re.S
)
ELSEWHERE = re.compile(r"^app$|/data/|dask_jobqueue")
"""Servers and clusters, which other tests start."""
REFUSED = {"reduce three-set-3000 --shift 2-5": 2}
"""Exit codes of commands whose refusal a page shows."""
SHIFT = ("synth -o shift.csv", "copy shift.card.toml truck.toml")
OUT = (*SHIFT, "identify shift.csv --vehicle truck.toml -o out")
RUNS = tuple(f"synth --seed {seed} -o run{seed}.csv" for seed in (1, 2, 3))
SHORT = {
    "build-a-model.md": (),
    "check-a-card.md": (),
    "make-a-card.md": (),
    "reduce-a-gearbox.md": (),
}
LONG = {
    "compare.md": (
        *OUT,
        "copy out monday",
        "identify shift.csv --vehicle truck.toml --method integral -o tuesday",
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
    "several-logs.md": RUNS,
    "synthetic-log.md": (),
}
"""Pages by name, with the commands that make the files which the page takes as given."""
WITHOUT_COMMANDS = ("install.md", "read-the-report.md", "workbench.md")
FRAGMENTS = ("bus-only.md", "many-runs.md", "notebook.md", "several-logs.md")
"""Pages with code that uses names of the reader; the notebooks of the examples run it whole."""
HOURS = ("calibrate.md", "own-controller.md")
"""Pages whose commands search for an hour; `tests/calibration` runs shorter ones."""


def run_line(line: str) -> None:
    """Run a command of the program, or `copy FROM TO`."""
    words = shlex.split(line)
    if words[0] != "copy":
        assert main(words) == REFUSED.get(line, 0), line
    elif Path(words[1]).is_dir():
        shutil.copytree(words[1], words[2])
    else:
        shutil.copy(words[1], words[2])


def run_page(name: str) -> None:
    """Run commands and code of a page in their order; the code shares its names."""
    names: dict[str, object] = {"__name__": "__main__"}
    for block in BLOCK.finditer((HOWTO / name).read_text(encoding="utf-8")):
        if ELSEWHERE.search(block["line"] or block["code"]):
            continue
        if block["line"] is not None:
            run_line(block["line"])
        elif name not in FRAGMENTS:
            exec(compile(block["code"], name, "exec"), names)


@pytest.mark.parametrize("name", SHORT)
def test_a_short_page_runs(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    run_page(name)
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
    run_page(name)


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
