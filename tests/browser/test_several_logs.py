# SPDX-License-Identifier: MIT
"""Two logs in one session: one fitted, one held out; and the zoom that views share."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import pytest
from playwright.sync_api import Page, expect

from tests.browser.bench import (
    PATIENCE,
    expect_message,
    serve_folder,
    show_view,
    synthesize,
    wait_for_rest,
    wait_for_whole_contents,
)
from tests.browser.watch import grave_findings

pytestmark = [pytest.mark.browser, pytest.mark.timeout(900)]

RANGE = "(id) => document.querySelector(`#${id} .js-plotly-plot`)._fullLayout.xaxis.range"
COUNT = """([id, low, high]) => document.querySelector(`#${id} .js-plotly-plot`)._fullData[0].x
    .filter((time) => time >= low && time <= high).length"""
SCHEMES: tuple[Literal["light", "dark"], ...] = ("light", "dark")


@pytest.fixture(scope="module")
def address(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A running workbench in a folder with two logs of one vehicle and its card."""
    folder = tmp_path_factory.mktemp("several")
    for seed, name in enumerate(("first", "second"), 1):
        synthesize(folder / f"{name}.csv", seed)
    (folder / "second.card.toml").unlink()
    with serve_folder(folder) as running:
        yield running


@pytest.fixture
def opened(page: Page, address: str) -> Page:
    """The page with both logs and the card open."""
    page.set_default_timeout(PATIENCE)
    expect.set_options(timeout=PATIENCE)
    page.set_viewport_size({"width": 1440, "height": 1000})
    page.goto(address)
    page.get_by_role("button", name="first.csv").click()
    expect_message(page, "first.csv is open")
    show_view(page, "card")
    page.get_by_label("Vehicle card", exact=True).fill("first.card.toml")
    page.click("#open-card")
    expect_message(page, "1 usable shift")
    show_view(page, "log")
    page.get_by_label("Log", exact=True).fill("second.csv")
    page.click("#add-log")
    expect_message(page, "second.csv is added: 1 usable shift")
    return page


def test_a_held_out_log_is_predicted(opened: Page, pictures: Path) -> None:
    page = opened
    expect(page.locator("#log-content")).to_contain_text("identified together")
    show_view(page, "shifts")
    page.get_by_label("use of shift 2→3 of second.csv").select_option("hold out")
    expect_message(page, "predicts 1 shift instead of fitting")
    expect(page.locator("#step-shifts")).to_contain_text("2 shifts of 2 logs found, 1 held out.")
    show_view(page, "identify")
    page.click("#identify")
    content = page.locator("#identify-content")
    expect(content).to_contain_text("Predicted, not fitted", timeout=300_000)
    expect(content).to_contain_text("consistent with noise")
    show_view(page, "model")
    page.wait_for_selector("#model-plot .js-plotly-plot")
    page.select_option("#model-log", "1")
    expect(page.locator("#model-content")).to_contain_text("No shift of second.csv was fitted")
    expect(page.locator("#step-model")).to_contain_text("The log shown was not fitted")
    for width in (1440, 900):
        page.set_viewport_size({"width": width, "height": 1000})
        for scheme in SCHEMES:
            page.emulate_media(color_scheme=scheme)
            for name in ("log", "shifts", "identify", "model"):
                show_view(page, name)
                wait_for_whole_contents(page)
                page.screenshot(
                    path=pictures / f"several-{name}-{width}-{scheme}.png", full_page=True
                )
                only = () if scheme == "light" else ("color-contrast",)
                assert grave_findings(page, *only) == [], (name, width, scheme)
                assert page.evaluate("document.body.scrollWidth <= window.innerWidth"), name


def test_a_zoom_is_carried_between_views(opened: Page) -> None:
    page = opened
    show_view(page, "channels")
    page.select_option("#preview", "1")
    page.wait_for_selector("#preview-plot .js-plotly-plot")
    area = page.locator("#channels-plot .nsewdrag").first
    area.scroll_into_view_if_needed()
    box = wait_for_rest(page, area)
    y = box["y"] + 0.5 * box["height"]
    page.mouse.move(box["x"] + 0.30 * box["width"], y)
    page.mouse.down()
    page.mouse.move(box["x"] + 0.40 * box["width"], y, steps=5)
    page.mouse.up()
    page.wait_for_function(
        f"() => {{ const [a, b] = ({RANGE})('channels-plot'); return b - a < 2; }}"
    )
    low, high = page.evaluate(RANGE, "channels-plot")
    for view, plot in (("channels", "preview-plot"), ("shifts", "phases-plot")):
        show_view(page, view)
        page.wait_for_selector(f"#{plot} .js-plotly-plot")
        page.wait_for_function(f"(id) => Math.abs(({RANGE})(id)[0] - {low}) < 1e-3", arg=plot)
        assert page.evaluate(RANGE, plot) == pytest.approx([low, high], abs=1e-3)
    assert page.evaluate(COUNT, ["phases-plot", low, high]) > 10
    page.select_option("#shifts-log", "1")
    page.wait_for_function(f"() => Math.abs(({RANGE})('phases-plot')[0] - {low}) > 1e-2")
