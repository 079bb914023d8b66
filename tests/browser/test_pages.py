# SPDX-License-Identifier: MIT
"""One contract of the pages of all commands: 900 px wide, no word cut, no scrolling sideways."""

from __future__ import annotations

from pathlib import Path

import pytest
from playwright.sync_api import Browser

from drivetwin.cli import main
from drivetwin.files.twin_file import save_twin
from tests.calibration.twins import make_hydraulic_twin
from tests.support.bus_logs import write_bus_logs

pytestmark = pytest.mark.browser

CONTROLLER = Path(__file__).parents[1] / "cli" / "own_controllers" / "regulator.toml"
WIDTH = 900
PAGES = (
    "identify/report.html",
    "examine/report.html",
    "comparison.html",
    "simulation.html",
    "observe.html",
    "shifts.html",
    "fit/report.html",
    "prediction.html",
    "bus/report.html",
    "drive/drive.html",
    "calibration/report.html",
    "tested/report.html",
    "fleet.html",
    "controller/report.html",
)
BROKEN = """() => [...document.querySelectorAll("td, th")].filter((cell) =>
    cell.offsetParent && cell.scrollWidth > cell.clientWidth + 1).map((cell) => cell.innerText)
    .concat([...document.querySelectorAll(".table")].filter((one) =>
    one.scrollWidth > one.clientWidth + 1).map((one) => one.innerText.slice(0, 80)))"""
"""Texts of the cells that are wider than their column, and of tables that scroll sideways."""


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pages")

    def run(*arguments: str) -> None:
        given = [one.replace("@", f"{folder}/") for one in arguments]
        assert main(given) == 0, given

    run("synth", "-o", "@shift.csv", "--seed", "1")
    run("identify", "@shift.csv", "--vehicle", "@shift.card.toml", "-o", "@identify")
    run("examine", "@shift.csv", "--vehicle", "@shift.card.toml", "-o", "@examine")
    run("report", "@identify", "@examine", "@shift.csv", "-o", "@comparison.html")
    run("simulate", "@identify", "@shift.csv", "-o", "@simulation.html")
    run("observe", "@identify", "@shift.csv", "-o", "@observe.html")
    run("shifts", "@shift.csv", "--vehicle", "@shift.card.toml", "-o", "@shifts.html")
    run("synth", "--model", "engine_start", "-o", "@k0.csv")
    run("fit", "@k0.model.toml", "@k0.csv", "-o", "@fit")
    run("simulate", "@fit", "@k0.csv", "-o", "@prediction.html")
    write_bus_logs(folder)
    run("identify", "@run0.csv", "@run1.csv", "@run2.csv", "--hold-out", "run2", "-o", "@bus")
    run("drive", "-o", "@drive")
    effort = ("--draws", "60", "--effort", "0.05")
    run("calibrate", "@identify", "--shift", "2-3", *effort, "--front", "-o", "@calibration")
    save_twin(folder / "hydraulic.toml", make_hydraulic_twin())
    tested = ("--shift", "2-3", "--controller", str(CONTROLLER), "--draws", "59", "-o", "@tested")
    run("try", "@hydraulic.toml", *tested)
    fleet = ("--vehicle", "@shift.card.toml", "--quick", "--workers", "1", "-o", "@store")
    run("fleet", "@shift.csv", *fleet)
    run("fleet", "report", "@store", "-o", "@fleet.html")
    run("synth", "--scenario", "controller_log", "-o", "@control.csv")
    run("identify", "@control.csv", "--vehicle", "@control.card.toml", "-o", "@controller")
    return folder


@pytest.mark.parametrize("name", PAGES)
def test_a_page_fits_900_px(name: str, pages: Path, browser: Browser) -> None:
    context = browser.new_context(viewport={"width": WIDTH, "height": 1000})
    page = context.new_page()
    page.goto((pages / name).as_uri())
    page.wait_for_selector("body[data-drawn]", state="attached", timeout=60_000)
    page.evaluate("() => document.querySelectorAll('details').forEach((one) => one.open = true)")
    assert page.evaluate("() => document.documentElement.scrollWidth") <= WIDTH
    assert page.evaluate(BROKEN) == []
    context.close()
