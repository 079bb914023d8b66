# SPDX-License-Identifier: MIT
"""Draw the README's picture: simulation over measurement of the demo's shift.

`python -m tools.picture` writes docs/img/validation.png; needs Chromium on the PATH.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from plotly.io import to_html

from drivetwin.cli.pipeline import run
from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import run as run_dyno
from drivetwin.dyno.scenarios import paper_steps
from drivetwin.identify.method import DEFAULT_METHOD
from drivetwin.report.figures.validation import validation_figure

PICTURE = Path(__file__).resolve().parents[1] / "docs" / "img" / "validation.png"
WIDTH, HEIGHT = 1000, 960
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
OPTIONS = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--hide-scrollbars",
    "--no-first-run",
    "--disable-background-networking",
    "--virtual-time-budget=5000",
    f"--window-size={WIDTH},{HEIGHT}",
)


def page(folder: Path) -> Path:
    """Make the demo's log in `folder`, identify it, and write a page of the figure alone."""
    log, card, _ = write_run(folder / "shift.csv", run_dyno(paper_steps(), seed=0))
    (validation,) = run(log, card, None, DEFAULT_METHOD).found.evidence["validation"]
    figure = validation_figure(validation)
    figure.update_layout(width=WIDTH, height=HEIGHT, paper_bgcolor="white")
    figure.layout.updatemenus = ()
    path = folder / "figure.html"
    text = to_html(figure, config={"displayModeBar": False}, default_width=WIDTH)
    path.write_text(f"<style>body {{ margin: 0 }}</style>{text}", encoding="utf-8")
    return path


def main() -> int:
    """Write the picture; 1 where no browser is found."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        print(f"no browser found: install one of {', '.join(BROWSERS)}", file=sys.stderr)
        return 1
    PICTURE.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        subprocess.run(
            [
                browser,
                *OPTIONS,
                f"--user-data-dir={folder / 'profile'}",
                f"--screenshot={PICTURE}",
                page(folder).as_uri(),
            ],
            check=True,
            capture_output=True,
        )
    print(f"wrote {PICTURE} ({PICTURE.stat().st_size / 1e3:.0f} kB)")
    return 0


if __name__ == "__main__":
    sys.exit(main())
