# SPDX-License-Identifier: MIT
"""Pictures of the first hour in the workbench, for the documents.

`python -m tests.browser.pictures` takes the German bench export of the tests from the log to the
report, and writes docs/img/first-hour-*.png; needs Chromium on the PATH.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
from pathlib import Path

from playwright.sync_api import Page, expect, sync_playwright

from tests.browser.bench import NAMES, PATIENCE, serve_folder, show_view
from tests.system.test_first_hour import write_bench_export

PICTURES = Path(__file__).resolve().parents[2] / "docs" / "img"
WIDTH, HEIGHT = 1280, 800
LOG, CARD = "messung.csv", "wagen.toml"
GAINS = {"B2": "0.0378", "B3": "0.027"}
"""Gains [m^3] that the user knows of the vehicle."""
RUN_LIMIT = 600_000
"""Time [ms] that the identification may take on a busy machine."""


def main() -> int:
    """Write the pictures; return 1 if no browser is found."""
    program = next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        print(f"no browser found: install one of {', '.join(NAMES)}", file=sys.stderr)
        return 1
    expect.set_options(timeout=PATIENCE)
    with tempfile.TemporaryDirectory() as name, sync_playwright() as playwright:
        folder = Path(name)
        write_bench_export(folder / LOG)
        browser = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        page = browser.new_page(viewport={"width": WIDTH, "height": HEIGHT})
        page.set_default_timeout(PATIENCE)
        with serve_folder(folder) as address:
            page.goto(address)
            take_pictures(page)
        browser.close()
    return 0


def take_pictures(page: Page) -> None:
    """Go through all steps; take a picture of each."""
    page.get_by_role("button", name=LOG).click()
    expect(page.locator("#message")).to_contain_text("is open")
    _save(page, "1-log")
    show_view(page, "channels")
    page.wait_for_selector("#channels-plot .js-plotly-plot")
    _save(page, "2-channels")
    _write_card(page)
    show_view(page, "shifts")
    page.wait_for_selector("#phases-plot .js-plotly-plot")
    _save(page, "4-shifts")
    show_view(page, "identify")
    page.click("#identify")
    page.locator("#identify-content .verdict").wait_for(timeout=RUN_LIMIT)
    _save(page, "5-identify")
    show_view(page, "model")
    page.wait_for_selector("#model-plot .js-plotly-plot")
    _save(page, "6-model")
    show_view(page, "export")
    _save(page, "7-export")


def _write_card(page: Page) -> None:
    """Fill in what the log does not show, and write the card."""
    show_view(page, "card")
    page.click("#begin-card")
    for element, gain in GAINS.items():
        for label, text in (
            (f"P0 of {element}", "0.8"),
            (f"Is the gain of {element} known", "gain"),
            (f"Gain N·D·A·r of {element}", gain),
        ):
            page.get_by_label(label).fill(text)
            page.keyboard.press("Tab")
            page.wait_for_timeout(1500)
    expect(page.locator("#form-state")).to_have_text("The card is complete.")
    page.get_by_label("P0 of B2").scroll_into_view_if_needed()
    _save(page, "3-card")
    page.get_by_label("File name").fill(CARD)
    page.click("#write-question")
    expect(page.locator("#message")).to_contain_text(f"{CARD} is written and open")


def _save(page: Page, name: str) -> None:
    """Save what the window shows, once figures have taken their size."""
    page.wait_for_timeout(1500)
    path = PICTURES / f"first-hour-{name}.png"
    page.screenshot(path=path)
    print(f"wrote {path} ({path.stat().st_size / 1e3:.0f} kB)")


if __name__ == "__main__":
    sys.exit(main())
