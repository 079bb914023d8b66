# SPDX-License-Identifier: MIT
"""The report as a person meets it: offline, zoomed, by keyboard, dark, on paper."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Page

from drivetwin.cli import main
from drivetwin.report.html import save_report
from tests.browser.watch import grave_findings
from tests.report.sample import log, simulated

pytestmark = pytest.mark.browser

A4_WIDTH, A4_HEIGHT = 690, 1024
"""Printable part of an A4 page [px] with the margins of report.css."""
STATE = """() => [...document.querySelectorAll(".plot")].filter((plot) => plot.curves).map(
    (plot) => ({link: plot.link, span: plot.layout.xaxis.range, points: plot.data[0].x.length}))"""


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Report of an identification by the default method."""
    folder = tmp_path_factory.mktemp("report")
    log, out = folder / "shift.csv", folder / "out"
    assert main(["synth", "--scenario", "paper_steps", "--seed", "1", "-o", str(log)]) == 0
    card = str(log.with_suffix(".card.toml"))
    assert main(["identify", str(log), "--vehicle", card, "-o", str(out)]) == 0
    twins = [str(shutil.copy(out / "twin.toml", folder / name)) for name in ("a.toml", "b.toml")]
    assert main(["report", *twins, str(log), "-o", str(out / "comparison.html")]) == 0
    return out / "report.html"


@pytest.fixture(scope="module")
def long_report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Report of a log of 200 s at 1 kHz."""
    path = tmp_path_factory.mktemp("long") / "report.html"
    found = simulated()
    save_report(path, found, log(np.arange(0.0, 200.0, 1e-3)))
    return path


def opened(page: Page, path: Path) -> Page:
    page.goto(path.as_uri())
    page.wait_for_selector("body[data-drawn]", state="attached", timeout=60_000)
    return page


def states(page: Page) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = page.evaluate(STATE)
    return found


def changed(page: Page, act: Callable[[], None]) -> list[dict[str, Any]]:
    """What the figures show after an action that changes their view."""
    before = states(page)
    act()
    page.wait_for_function(f"(before) => JSON.stringify(({STATE})()) !== before", arg=_json(before))
    return states(page)


def _json(value: object) -> str:
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False)


def zoom(page: Page, section: str, label: str) -> list[dict[str, Any]]:
    return changed(page, page.locator(f"#{section} .zooms button", has_text=label).first.click)


@pytest.mark.short
def test_a_zoom_goes_through_all_figures_of_the_shift(page: Page, report: Path) -> None:
    opened(page, report)
    shown = zoom(page, "shift", "inertia phase")
    spans = {tuple(one["span"]) for one in shown if one["link"]}
    assert len(spans) == 1
    others = {tuple(one["span"]) for one in shown if not one["link"]}
    assert others.isdisjoint(spans), "what shows the lock-up oscillation alone would be empty"
    start, end = spans.pop()
    assert 0.1 < end - start < 1.0


def test_a_moment_under_the_mouse_is_marked_in_the_other_figures(page: Page, report: Path) -> None:
    opened(page, report)
    plot = page.locator("#shift .plot").first
    plot.scroll_into_view_if_needed()
    plot.hover(position={"x": 400, "y": 300})
    page.wait_for_function("() => document.querySelector('#validation .cursor').hidden === false")
    assert page.locator("#validation .cursor").first.get_attribute("data-time")
    assert page.evaluate("document.querySelector('#shift .cursor').hidden")


def test_everything_can_be_done_by_keyboard(page: Page, report: Path) -> None:
    opened(page, report)
    page.locator("#shift .zooms button", has_text="torque phase").first.focus()
    start, end = changed(page, lambda: page.keyboard.press("Enter"))[0]["span"]
    page.locator("#shift .plot").first.focus()
    moved = changed(page, lambda: page.keyboard.press("ArrowRight"))[0]["span"]
    assert moved[0] == pytest.approx(start + (end - start) / 5)
    nearer = changed(page, lambda: page.keyboard.press("+"))[0]["span"]
    assert np.ptp(nearer) == pytest.approx((end - start) / 2)


@pytest.mark.timeout(600)
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_nobody_is_locked_out(browser: Browser, report: Path, pictures: Path, scheme: Any) -> None:
    for path in (report, report.with_name("comparison.html")):
        context = browser.new_context(color_scheme=scheme, viewport={"width": 1280, "height": 1000})
        page = opened(context.new_page(), path)
        assert grave_findings(page) == []
        page.screenshot(path=pictures / f"{path.stem}-{scheme}.png", full_page=True)
        context.close()


@pytest.mark.short
def test_the_first_screen_has_verdict_plot_and_parameters(page: Page, report: Path) -> None:
    for width, nav_width in ((1440, 210), (900, 168)):
        page.set_viewport_size({"width": width, "height": 900})
        opened(page, report)
        boxes = [
            page.locator(name).first.bounding_box()
            for name in ("#result .verdict", "#result .plot", "#result tbody tr", "nav")
        ]
        (verdict, plot, row, nav) = (box for box in boxes if box is not None)
        assert verdict["y"] < plot["y"] < row["y"] < 900 - row["height"]
        assert nav["width"] == nav_width
        assert page.evaluate("document.documentElement.scrollWidth") == width


def test_paper_answers_on_its_first_page(page: Page, report: Path, pictures: Path) -> None:
    page.set_viewport_size({"width": A4_WIDTH, "height": A4_HEIGHT})
    opened(page, report)
    page.emulate_media(media="print")
    verdict, plot, table = (
        page.locator(f"#result {part}").first.bounding_box()
        for part in (".verdict", ".plot", "table")
    )
    assert verdict is not None
    assert plot is not None
    assert table is not None
    assert verdict["y"] < plot["y"] < table["y"] < A4_HEIGHT - table["height"]
    page.pdf(path=pictures / "report.pdf", prefer_css_page_size=True, print_background=True)
    pages = (pictures / "report.pdf").read_bytes().count(b"/Type /Page\n")
    assert 5 < pages < 20


def test_a_long_log_zooms_at_once_into_every_sample(page: Page, long_report: Path) -> None:
    assert long_report.stat().st_size < 6_000_000
    opened(page, long_report)
    assert zoom(page, "shift", "whole")[0]["points"] <= 4000
    found = zoom(page, "shift", "torque phase")[0]
    seen = 1e3 * (found["span"][1] - found["span"][0])
    assert found["points"] == pytest.approx(2.0 * seen, abs=3.0)


def test_on_a_phone_figures_and_tables_keep_a_readable_size(report: Path, page: Page) -> None:
    page.set_viewport_size({"width": 375, "height": 800})
    opened(page, report)
    sizes = """(tag) => [...document.querySelectorAll(tag)].map(
        (one) => {const box = one.getBoundingClientRect(); return [box.width, box.height]})"""
    assert min(width for width, _ in page.evaluate(sizes, ".plot")) >= 640
    assert max(height for _, height in page.evaluate(sizes, "tr")) < 200
    assert max(width for width, _ in page.evaluate(sizes, "figcaption, caption")) <= 375
    assert page.evaluate("document.documentElement.scrollWidth") == 375
