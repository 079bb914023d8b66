# SPDX-License-Identifier: MIT
"""Write the gallery: docs/gallery.md and docs/img/gallery-*.png.

`python -m tools.gallery` runs the commands of each entry in an empty folder and draws the page that
they write; needs Chromium on the PATH. `python -m tools.gallery NAME...` draws some entries.
"""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from tools.picture import BROWSERS, OPTIONS, PICTURES

PAGE = PICTURES.parent / "gallery.md"
_SIZE = "--window-size=1200,1000"


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
        "Pressures and engine torque of a shift that stays comfortable over the spread of made "
        "units, with its certificate.",
        (*_SHIFT, "drivetwin calibrate shift/twin.toml --shift 2-3 -o calibration"),
        "calibration/report.html",
    ),
    Entry(
        "fleet",
        "A fleet",
        "Shared values, spread over units and outliers from the logs of several vehicles.",
        (
            *(f"drivetwin synth --seed {seed} -o logs/unit_{seed}/shift.csv" for seed in range(8)),
            "drivetwin fleet logs --vehicle logs/unit_0/shift.card.toml --method integral -o store",
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
        "Dogs engage beforehand through their synchronisers; the torque passes from clutch to "
        "clutch.",
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


def draw_entry(browser: str, entry: Entry) -> Path:
    """Run the commands of an entry and draw its page.

    Raises
    ------
    CalledProcessError
        A command or the browser fails.
    """
    picture = PICTURES / f"gallery-{entry.name}.png"
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for command in entry.commands:
            _, *arguments = shlex.split(command)
            for argument in arguments:
                if argument.startswith("logs/"):
                    (folder / argument).parent.mkdir(parents=True, exist_ok=True)
            program = [sys.executable, "-m", "drivetwin", *arguments]
            subprocess.run(program, check=True, capture_output=True, cwd=folder)
        profile = f"--user-data-dir={folder / 'profile'}"
        address = (folder / entry.page).as_uri()
        options = [*OPTIONS, _SIZE, profile, f"--screenshot={picture}"]
        subprocess.run([browser, *options, address], check=True, capture_output=True)
    return picture


def main(names: list[str]) -> int:
    """Draw the entries of these names, or all, and write the page; return 1 without a browser."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        print(f"no browser found: install one of {', '.join(BROWSERS)}", file=sys.stderr)
        return 1
    for entry in ENTRIES:
        if not names or entry.name in names:
            picture = draw_entry(browser, entry)
            print(f"wrote {picture} ({picture.stat().st_size / 1e3:.0f} kB)", flush=True)
    PAGE.write_text(write_page(), encoding="utf-8")
    print(f"wrote {PAGE}")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
