# SPDX-License-Identifier: MIT
"""Write the gallery and the pictures of the tutorials.

`python -m tools.gallery` runs the commands of each entry in an empty folder and draws the page that
they write: docs/gallery.md and docs/img/gallery-*.png. It runs each tutorial in the same way, draws
docs/img/tutorial-*.png and writes the notebook. Needs Chromium on the PATH.
`python -m tools.gallery NAME...` draws some entries and tutorials.
"""

from __future__ import annotations

import json
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import chdir
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from playwright.sync_api import sync_playwright

from tools.picture import BROWSERS, PICTURES
from tools.run_page import run_page

PAGE = PICTURES.parent / "gallery.md"
TUTORIALS = PICTURES.parent / "tutorial"
NOTEBOOK = TUTORIALS / "notebook.ipynb"
_WINDOW = (1200, 1000)
_TUTORIAL_WINDOW = (1000, 760)
_SETTLED = 2000
"""Time until a page has drawn its figures [ms]."""


@dataclass(frozen=True)
class Entry:
    """One result: commands, the page that they write, a heading and a sentence."""

    name: str
    title: str
    sentence: str
    commands: tuple[str, ...]
    page: str


_SHIFT = (
    "drivetwin synth -o shift.csv",
    "drivetwin identify shift.csv --vehicle shift.card.toml -o shift",
)
_OTHER = (
    "drivetwin synth --seed 2 -o other.csv",
    "drivetwin identify other.csv --vehicle other.card.toml -o other",
)
ENTRIES = (
    Entry(
        "shift",
        "A validated shift",
        "Inertias, efficiency, stiffness and friction of a truck from one power-on upshift; the "
        "simulation lies over the measurement.",
        _SHIFT,
        "shift/report.html",
    ),
    Entry(
        "comparison",
        "Two logs compared",
        "Parameters of two identifications side by side, with the significance of each difference.",
        (*_SHIFT, *_OTHER, "drivetwin report shift other -o comparison.html"),
        "comparison.html",
    ),
    Entry(
        "observer",
        "Torques without a sensor",
        "Output torque and clutch torques from speeds and pressures by the identified model, with "
        "95 % bands.",
        (*_SHIFT, "drivetwin observe shift shift.csv -o torques.html"),
        "torques.html",
    ),
    Entry(
        "calibration",
        "A calibrated shift",
        "Pressures and engine torque of a shift that stays comfortable over production "
        "scatter, with its certificate.",
        (*_SHIFT, "drivetwin calibrate shift/twin.toml --shift 2-3 -o calibration"),
        "calibration/report.html",
    ),
    Entry(
        "fleet",
        "A fleet",
        "Shared values, spread over units and outliers from the logs of several vehicles.",
        (
            *(f"drivetwin synth --seed {seed} -o logs/unit_{seed}/shift.csv" for seed in range(8)),
            "drivetwin fleet logs --vehicle logs/unit_0/shift.card.toml --quick -o store",
            "drivetwin fleet report store",
        ),
        "store/report.html",
    ),
    Entry(
        "drive",
        "A drive through all gears",
        "Launch with torque converter, lock-up, and all four kinds of shift of a six-speed truck "
        "gearbox; the energy balance closes to 1e-6 J.",
        ("drivetwin drive three-set-4000cr -o drive",),
        "drive/drive.html",
    ),
    Entry(
        "dual-clutch",
        "A dual-clutch gearbox",
        "*Dogs* (toothed clutches) engage beforehand through their synchronisers; the torque "
        "passes from clutch to clutch.",
        ("drivetwin drive dual-clutch-7 --course launch -o drive",),
        "drive/drive.html",
    ),
    Entry(
        "engine-start",
        "A clutch that starts an engine",
        "Engine inertia, drag and friction of the separating clutch K0 of a hybrid, fitted by "
        "exact derivatives.",
        (
            "drivetwin synth --model engine_start -o k0.csv",
            "drivetwin fit k0.model.toml k0.csv -o k0",
        ),
        "k0/report.html",
    ),
    Entry(
        "tip-in",
        "A tip-in through play",
        "Stiffness, damping and backlash of a driveline from one step of the pedal.",
        (
            "drivetwin synth --model tip_in -o tip_in.csv",
            "drivetwin fit tip_in.model.toml tip_in.csv -o tip_in",
        ),
        "tip_in/report.html",
    ),
    Entry(
        "kinds",
        "Shift quality",
        "Figures of shift quality of a log by kind of shift and pair of gears.",
        (
            "drivetwin synth --scenario gearbox_chain -o chain.csv",
            "drivetwin shifts chain.csv --vehicle chain.card.toml -o quality.html",
        ),
        "quality.html",
    ),
)


def write_page() -> str:
    """Return the text of the gallery."""
    parts = [
        "# Gallery\n",
        "Ten results, each with the commands that make it in an empty folder. `python -m "
        "tools.gallery` draws the pictures and writes this page.\n",
    ]
    for one in ENTRIES:
        commands = "\n".join(f"    {command}" for command in one.commands)
        parts += [
            f"## {one.title}\n",
            f"{one.sentence}\n",
            f"![{one.title}](img/gallery-{one.name}.png)\n",
            f"{commands}\n",
        ]
    return "\n".join(parts)


@dataclass(frozen=True)
class Shot:
    """A part of a page to draw.

    The file, the selector of an element or "" for the window, and the greatest height [px].
    """

    page: str
    place: str = ""
    height: int = 1000


SHOTS: Mapping[str, Mapping[str, Shot]] = {
    "bench-log": {
        "bench-overview": Shot("out/report.html", "#result figure"),
        "bench-simulation": Shot("out/report.html", "#validation figure", 620),
        "bench-parameters": Shot("out/report.html", "#result table"),
        "bench-friction": Shot("out/report.html", "#friction figure"),
        "bench-calibration": Shot("calibration/report.html", "#profiles figure"),
    },
    "bus-log": {
        "bus-decays": Shot("bus/report.html", "#decays figure"),
        "bus-prediction": Shot("bus/report.html", "#predictions figure"),
    },
    "notebook": {
        "notebook-log": Shot("log.html"),
        "notebook-simulation": Shot("simulation.html"),
        "notebook-softer": Shot("softer.html"),
    },
}
"""Pictures of each tutorial: name after `tutorial-`, and its source in the folder of the run."""


def draw_shots(browser: str, shots: Mapping[Path, Shot], window: tuple[int, int]) -> None:
    """Save each shot, whose page is a path from the current folder, as the picture of its key."""
    width, height = window
    with sync_playwright() as playwright:
        opened = playwright.chromium.launch(executable_path=browser, args=["--no-sandbox"])
        page = opened.new_page(viewport={"width": width, "height": height})
        for picture, shot in shots.items():
            page.goto(Path(shot.page).resolve().as_uri())
            page.wait_for_timeout(_SETTLED)
            box = page.locator(shot.place or "body").first.bounding_box()
            frame = (
                box if shot.place and box else {"x": 0, "y": 0, "width": width, "height": height}
            )
            frame["height"] = min(frame["height"], shot.height)
            page.screenshot(path=picture, clip=frame, full_page=True)
            print(f"wrote {picture} ({picture.stat().st_size / 1e3:.0f} kB)", flush=True)
        opened.close()


def draw_entry(browser: str, entry: Entry) -> None:
    """Run the commands of an entry and draw its page.

    Raises
    ------
    CalledProcessError
        A command fails.
    """
    for command in entry.commands:
        _, *arguments = shlex.split(command)
        for argument in arguments:
            if argument.startswith("logs/"):
                Path(argument).parent.mkdir(parents=True, exist_ok=True)
        program = [sys.executable, "-m", "drivetwin", *arguments]
        subprocess.run(program, check=True, capture_output=True)
    draw_shots(browser, {PICTURES / f"gallery-{entry.name}.png": Shot(entry.page)}, _WINDOW)


def draw_tutorial(browser: str, name: str) -> None:
    """Run a tutorial and draw its pictures."""
    run_page(TUTORIALS / f"{name}.md")
    shots = {PICTURES / f"tutorial-{one}.png": shot for one, shot in SHOTS[name].items()}
    draw_shots(browser, shots, _TUTORIAL_WINDOW)


def write_notebook(page: str) -> str:
    """Return the text and the code of a tutorial as a notebook without outputs."""
    cells: list[dict[str, Any]] = [
        {"cell_type": kind, "id": f"cell-{number}", "metadata": {}, "source": source}
        | ({"execution_count": None, "outputs": []} if kind == "code" else {})
        for number, (kind, source) in enumerate(_split_cells(page))
    ]
    metadata = {"language_info": {"name": "python"}}
    notebook = {"cells": cells, "metadata": metadata, "nbformat": 4, "nbformat_minor": 5}
    return json.dumps(notebook, indent=1, ensure_ascii=False) + "\n"


def _split_cells(page: str) -> Iterator[tuple[str, str]]:
    """Split a page into text and code; printed text and pictures follow from the code."""
    page = re.sub(r"^```text\n.*?^```\n+|^!\[[^\n]*\n+", "", page, flags=re.M | re.S)
    for number, part in enumerate(re.split(r"^```python\n(.*?)^```$", page, flags=re.M | re.S)):
        if part.strip():
            yield ("code" if number % 2 else "markdown"), part.strip()


def main(names: list[str]) -> int:
    """Draw the entries of these names, or all, and write the page; return 1 without a browser."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        print(f"no browser found: install one of {', '.join(BROWSERS)}", file=sys.stderr)
        return 1
    for entry in ENTRIES:
        if not names or entry.name in names:
            with tempfile.TemporaryDirectory() as folder, chdir(folder):
                draw_entry(browser, entry)
    for tutorial in SHOTS:
        if not names or tutorial in names:
            with tempfile.TemporaryDirectory() as folder, chdir(folder):
                draw_tutorial(browser, tutorial)
    PAGE.write_text(write_page(), encoding="utf-8")
    source = (TUTORIALS / "notebook.md").read_text(encoding="utf-8")
    NOTEBOOK.write_text(write_notebook(source), encoding="utf-8")
    print(f"wrote {PAGE} and {NOTEBOOK}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
