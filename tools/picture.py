# SPDX-License-Identifier: MIT
"""Draw the pictures of the documents from the demo's shift and a tip-in.

`python -m tools.picture` writes docs/img/report.png (first page of the report) and docs/img/fit.png
(report of the fit of a tip-in); needs Chromium on the PATH.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from drivetwin.cli.identify import run_identification
from drivetwin.cli.requests.identification import IdentifyOptions
from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import run as run_dyno
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.result.method import DEFAULT_METHOD
from drivetwin.fit.fit import fit_network
from drivetwin.fit.model_file import read_model
from drivetwin.fit.read import read_recording
from drivetwin.fit.synthesize import ModelName, read_builtin, synthesize_log
from drivetwin.report.fit import build_fit_page
from drivetwin.report.html import render_page, save_report
from drivetwin.validation.validated_model import JointIdentification

PICTURES = Path(__file__).resolve().parents[1] / "docs" / "img"
WIDTH, HEIGHT = 1000, 960
BROWSERS = ("chromium", "chromium-browser", "google-chrome")
OPTIONS = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--no-first-run"),
    *("--disable-background-networking", "--virtual-time-budget=20000"),
    f"--window-size={WIDTH},{HEIGHT}",
)


def identify_demo(folder: Path) -> JointIdentification:
    """Write the log of the demo into `folder` and identify it."""
    log, card, _ = write_run(folder / "shift.csv", run_dyno(load_scenario("paper_steps"), seed=0))
    return run_identification([log], IdentifyOptions(vehicle=card, method=DEFAULT_METHOD))


def write_report(outcome: JointIdentification, folder: Path) -> Path:
    """Write the report."""
    path = folder / "report.html"
    save_report(path, outcome.found, outcome.fitted[0])
    return path


def write_fit(folder: Path) -> Path:
    """Write the report of the fit of a tip-in."""
    made = synthesize_log(*read_builtin(ModelName.TIP_IN), seed=0)
    log, model = folder / "tip_in.csv", folder / "tip_in.model.toml"
    log.write_text(made.log, encoding="utf-8")
    model.write_text(made.model, encoding="utf-8")
    network, channels = read_model(model)
    recording, _ = read_recording(log, network, channels)
    page = render_page(build_fit_page(fit_network(network, [recording]), [log.name], {}))
    path = folder / "fit.html"
    path.write_text(page, encoding="utf-8")
    return path


def main() -> int:
    """Write the pictures; return 1 if no browser is found."""
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        print(f"no browser found: install one of {', '.join(BROWSERS)}", file=sys.stderr)
        return 1
    PICTURES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        report = write_report(identify_demo(folder), folder)
        draw_page(browser, report, PICTURES / "report.png")
        draw_page(browser, write_fit(folder), PICTURES / "fit.png")
    return 0


def draw_page(browser: str, page: Path, picture: Path) -> None:
    """Save a picture of a page in the browser. Raises CalledProcessError if that fails."""
    profile = f"--user-data-dir={page.parent / 'profile'}"
    command = [browser, *OPTIONS, profile, f"--screenshot={picture}", page.as_uri()]
    subprocess.run(command, check=True, capture_output=True)
    print(f"wrote {picture} ({picture.stat().st_size / 1e3:.0f} kB)")


if __name__ == "__main__":
    sys.exit(main())
