# SPDX-License-Identifier: MIT
"""A running workbench in a folder of its own, and the actions of a user on its page."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from playwright.sync_api import FloatRect, Locator, Page, expect

from drivetwin.cli import main

ROOT = Path(__file__).resolve().parents[2]
GIVEN = ROOT.parent / "shared" / "logs" / "truck_a.csv"
NAMES = ("chromium", "chromium-browser", "google-chrome")
"""Programs of the browser."""
PATIENCE = 300_000
"""Time [ms] that a step may take on a busy machine."""
STEPS = ("log", "channels", "card", "shifts", "identify", "model", "export")
VIEWS = (*STEPS, "workspace")
INERTIA = 2
"""Place of the line that starts the inertia phase among those that can be dragged."""


@dataclass(frozen=True)
class Bench:
    """A running workbench: its address, its folder, and the column whose unit is wrong."""

    address: str
    folder: Path
    log: str
    card: str
    wrong: str

    def shown(self, page: Page) -> Page:
        """The page, loaded, with a session of its own."""
        page.set_default_timeout(PATIENCE)
        expect.set_options(timeout=PATIENCE)
        page.set_viewport_size({"width": 1440, "height": 1000})
        page.goto(self.address)
        page.wait_for_selector("#log-names option", state="attached")
        return page


def _write_wrong_unit(log: Path) -> str:
    """Write `mbar` over the unit of the last pressure of a log; returns the column's name."""
    names, units, *rest = log.read_text().split("\n")
    columns, spelled = names.split(","), units.split(",")
    place = len(spelled) - 1 - spelled[::-1].index("bar")
    spelled[place] = "mbar"
    log.write_text("\n".join([names, ",".join(spelled), *rest]))
    return columns[place]


def synthesize(log: Path, seed: int) -> tuple[Path, Path]:
    """Write a synthetic log and its card."""
    assert main(["synth", "-o", str(log), "--scenario", "paper_steps", "--seed", str(seed)]) == 0
    return log, log.with_suffix(".card.toml")


@contextmanager
def serve(folder: Path) -> Iterator[Bench]:
    """Run the program in a folder with truck_a, or a synthetic log where that is absent."""
    if GIVEN.exists():
        log, card = folder / "truck_a.csv", folder / "truck_a.toml"
        log.write_bytes(GIVEN.read_bytes())
        card.write_bytes((ROOT / "examples" / "vehicles" / "truck_a.toml").read_bytes())
    else:
        log, card = synthesize(folder / "bench.csv", 1)
    wrong = _write_wrong_unit(log)
    with serve_folder(folder) as address:
        yield Bench(address, folder, log.name, card.name, wrong)


@contextmanager
def serve_folder(folder: Path) -> Iterator[str]:
    """Run the program in a folder; yields the address of the page."""
    command = [sys.executable, "-m", "drivetwin", "app", "--port", "0", "--no-browser"]
    server = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    printed = server.stdout.readline()
    found = re.search(r"http://\S+/\?token=\S+", printed)
    assert found, printed
    try:
        yield found.group()
    finally:
        server.terminate()
        server.wait(10.0)
        server.stdout.close()


def open_files(page: Page, bench: Bench) -> None:
    """Open the log, then its card."""
    page.get_by_label("Log", exact=True).fill(bench.log)
    page.click("#open-log")
    expect_message(page, f"{bench.log} is open")
    show_view(page, "card")
    page.get_by_label("Vehicle card", exact=True).fill(bench.card)
    page.click("#open-card")
    expect_message(page, f"{bench.card} is open")


def show_view(page: Page, name: str) -> None:
    page.click(f"#nav-{name}")
    expect(page.locator(f"#view-{name}")).to_be_visible()


def wait_for_whole_contents(page: Page) -> None:
    """Wait until all tables and plots end within the page; a plot follows the width of its view."""
    page.wait_for_function(
        "() => Array.from(document.querySelectorAll('.table, .js-plotly-plot'))"
        ".every((one) => one.scrollWidth <= one.clientWidth)"
    )


def expect_message(page: Page, text: str) -> None:
    expect(page.locator("#message")).to_contain_text(text)


def correct_unit(page: Page, bench: Bench) -> None:
    show_view(page, "channels")
    unit = page.get_by_label(f"unit of {bench.wrong}")
    expect(unit).to_have_value("mbar")
    unit.fill("bar")
    page.click("#apply-mapping")
    expect_message(page, "1 usable shift")


def identify(page: Page) -> None:
    show_view(page, "identify")
    page.click("#identify")
    expect(page.locator("#progress-box")).to_be_visible()
    expect(page.locator("#status")).to_contain_text("identified", timeout=180_000)
    expect(page.locator("#identify")).to_be_enabled(timeout=180_000)


def wait_for_rest(page: Page, thing: Locator) -> FloatRect:
    """Place of something once it has stopped moving: figures take their size after they show."""
    before = None
    while (present := thing.bounding_box()) is None or present != before:
        before = present
        page.wait_for_timeout(700)
    return present


def drag_inertia_start(page: Page) -> tuple[float, float]:
    """Drag the line some pixels to the right; returns the time before and after."""
    show_view(page, "shifts")
    field = page.get_by_label("3 inertia phase starts [s]")
    before = float(field.input_value())
    line = page.locator("#phases-plot .shapelayer path[style*='cursor: move']").nth(INERTIA)
    box = wait_for_rest(page, line)
    x, y = box["x"] + box["width"] / 2, box["y"] + 0.25 * box["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 10, y, steps=5)  # less than 8 pixels are taken for a click
    page.mouse.up()
    expect_message(page, "3 inertia phase starts at")
    expect(field).not_to_have_value(f"{before:g}")
    return before, float(field.input_value())
