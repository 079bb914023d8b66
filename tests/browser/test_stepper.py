# SPDX-License-Identifier: MIT
"""The steps of the workbench by keyboard alone and by axe-core, wide and narrow, light and dark."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Literal

import pytest
from playwright.sync_api import Page, expect

from tests.browser.bench import (
    PATIENCE,
    STEPS,
    VIEWS,
    Bench,
    show_view,
    wait_for_whole_contents,
)
from tests.browser.watch import grave_findings

pytestmark = [pytest.mark.browser, pytest.mark.timeout(600)]

WIDTHS, HEIGHT = (1440, 900), 900
SCHEMES: tuple[Literal["light", "dark"], ...] = ("light", "dark")
CUT = """() => Array.from(document.querySelectorAll('section:not([hidden]) :is(td, th, small, '
  + 'label, .table, .label, .badge, .lock, .range, button, select)'))
  .filter((one) => one.checkVisibility() && (one.getBoundingClientRect().right > innerWidth + 1
    || (getComputedStyle(one).display !== 'inline' && one.scrollWidth > one.clientWidth + 1)))
  .map((one) => `${one.tagName} ${one.className} ${one.textContent.slice(0, 60)}`)"""
"""Texts and tables of the shown view that are wider than their place."""
MOST_STOPS = 150
"""Most presses of Tab to reach a control of a view."""
STATES = (
    """() => Array.from(document.querySelectorAll('.side .state')).map((one) => one.innerText)"""
)


def _reach(page: Page, selector: str) -> None:
    """Press Tab until a control has the focus."""
    for _ in range(MOST_STOPS):
        if page.evaluate("(one) => document.activeElement.matches(one)", selector):
            return
        page.keyboard.press("Tab")
    raise AssertionError(f"the keyboard does not reach {selector}")


def _press(page: Page, selector: str) -> None:
    _reach(page, selector)
    page.keyboard.press("Enter")


def _wait_for_states(page: Page, *states: str) -> None:
    page.wait_for_function(f"(wanted) => ({STATES})().join() === wanted", arg=",".join(states))


def test_all_steps_by_keyboard(shown: Page, tmp_path: Path) -> None:
    """From the sample to a report without a mouse; each step shows its state."""
    page = shown
    _wait_for_states(page, "next", *["blocked"] * 6)
    _press(page, "#open-sample")
    _wait_for_states(page, *["done"] * 4, "next", "blocked", "blocked")
    for step in ("channels", "card", "shifts", "identify"):
        _press(page, f"section:not([hidden]) button[data-go={step}]")
        expect(page.locator(f"#view-{step}")).to_be_visible()
        page.wait_for_function("() => document.activeElement.tagName === 'H2'")
    _press(page, "#identify")
    _wait_for_states(page, *["done"] * 4, "running", "blocked", "blocked")
    expect(page.locator(".verdict")).to_have_count(0)
    _wait_for_states(page, *["done"] * 5, "next", "open")
    expect(page.locator("#identify-content .verdict .word")).to_have_text(re.compile("^Model:"))
    _press(page, "button[data-go=model]")
    page.wait_for_selector("#model-plot .js-plotly-plot")
    _reach(page, "input[type=range]")
    before = page.locator("#model-fit").text_content() or ""
    page.keyboard.press("ArrowRight")
    expect(page.locator("#model-fit")).not_to_have_text(before)
    _press(page, "button[data-go=export]")
    with page.expect_download() as handed:
        _press(page, "#view-export button[id*='report.html']")
    handed.value.save_as(tmp_path / "report.html")
    assert "Model: " in (tmp_path / "report.html").read_text()
    _wait_for_states(page, *["done"] * 7)


def test_two_cursors_by_mouse_and_keyboard(shown: Page, bench: Bench) -> None:
    page = shown
    page.get_by_role("button", name=bench.log).click()
    expect(page.locator("#log-content")).to_contain_text("channels mapped")
    show_view(page, "channels")
    page.select_option("#preview", "1")
    box = page.locator("#preview-content .cursors")
    first, second = (box.get_by_label(f"Cursor {name}") for name in "AB")
    first.fill("1")
    second.fill("1.5")
    expect(box.locator("caption")).to_have_text("Δt = 0.5 s, 1/Δt = 2 Hz")
    expect(box.locator("tbody tr")).to_have_count(1)
    expect(page.locator("#preview-plot .cursor")).to_have_count(2)
    plot = page.locator("#preview-plot .nsewdrag")
    plot.click(position={"x": 300, "y": 60})
    expect(first).not_to_have_value("1")
    before = second.input_value()
    plot.click(position={"x": 500, "y": 60}, modifiers=["Shift"])
    expect(second).not_to_have_value(before)
    with page.expect_download() as image:
        box.get_by_role("button", name="Save as PNG").click()
    assert image.value.suggested_filename == "preview-plot.png"
    box.get_by_role("button", name="Clear cursors").click()
    expect(page.locator("#preview-plot .cursor")).to_have_count(0)


@pytest.mark.timeout(1800)
def test_each_view_is_accessible_wide_and_narrow_in_light_and_dark(
    shown: Page, pictures: Path
) -> None:
    page = shown
    page.click("#open-sample")
    _wait_for_states(page, *["done"] * 4, "next", "blocked", "blocked")
    show_view(page, "identify")
    page.click("#identify")
    _wait_for_states(page, *["done"] * 5, "next", "open")
    show_view(page, "model")
    page.wait_for_selector("#model-plot .js-plotly-plot")
    findings = {}
    for width in WIDTHS:
        page.set_viewport_size({"width": width, "height": HEIGHT})
        for scheme in SCHEMES:
            page.emulate_media(color_scheme=scheme)
            for name in VIEWS:
                show_view(page, name)
                wait_for_whole_contents(page)
                page.screenshot(path=pictures / f"workbench-{name}-{width}-{scheme}.png")
                only = () if scheme == "light" else ("color-contrast",)
                findings[width, scheme, name] = grave_findings(page, *only)
                assert page.evaluate("document.body.scrollWidth <= window.innerWidth"), name
                assert page.evaluate(CUT) == [], (name, width)
        show_view(page, "model")
        _expect_sliders_beside_the_plot(page)
    assert {place: found for place, found in findings.items() if found} == {}


def _expect_sliders_beside_the_plot(page: Page) -> None:
    """Each slider ends before the plot begins, and when it is in the window the plot is too."""
    for slider in page.locator(".slider").all():
        slider.scroll_into_view_if_needed()
        assert slider.evaluate("(one) => one.scrollWidth <= one.clientWidth"), slider.inner_text()
        box, plot = slider.bounding_box(), page.locator(".bench > :last-child").bounding_box()
        assert box is not None
        assert plot is not None
        assert box["x"] + box["width"] <= plot["x"]
        shown = min(plot["y"] + plot["height"], HEIGHT) - max(plot["y"], 0.0)
        assert shown > 350.0, "the plot is outside the window"
    drawn = page.locator("#model-plot .js-plotly-plot")
    assert drawn.evaluate("(one) => one._fullLayout.yaxis.title.text").startswith("output")
    page.locator(".bench").evaluate("(one) => one.scrollIntoView()")
    place = page.locator("#model-plot").bounding_box()
    assert place is not None
    assert place["y"] < 0.25 * HEIGHT, "the outputs are below the window"
    expect(page.locator(".slider", has_text="k_o")).to_contain_text(" ± ")


def test_a_card_by_the_form(shown: Page, pictures: Path) -> None:
    """Questions follow from answers, the focus stays, and the written card is open."""
    page = shown
    page.click("#open-sample")
    _wait_for_states(page, *["done"] * 4, "next", "blocked", "blocked")
    show_view(page, "card")
    page.click("#begin-card")
    for element in ("B2", "B3"):
        page.get_by_label(f"Is the gain of {element} known").fill("gain")
        page.keyboard.press("Tab")
        expect(page.get_by_label(f"Gain N·D·A·r of {element}")).to_be_visible()
        page.wait_for_function("() => document.activeElement.tagName === 'INPUT'")
    page.get_by_label("Gain N·D·A·r of B2").fill("0,03")
    page.keyboard.press("Tab")
    expect(page.locator("#form-fields")).to_contain_text("write a point instead of the comma")
    for element, gain in (("B2", "0.0302"), ("B3", "0.027")):
        page.get_by_label(f"Gain N·D·A·r of {element}").fill(gain)
        page.get_by_label(f"P0 of {element}").fill("0.8+-0.1")
        page.keyboard.press("Tab")
    expect(page.locator("#form-state")).to_have_text("The card is complete.")
    page.screenshot(path=pictures / "workbench-card-form.png", full_page=True)
    assert grave_findings(page) == []
    page.get_by_label("File name").fill("written.toml")
    page.click("#write-question")
    expect(page.locator("#message")).to_contain_text("written.toml is written and open")
    expect(page.locator("#message")).not_to_contain_text("shifts lists")
    page.click("#write-question")
    expect(page.locator("#message")).to_contain_text("this file exists")
    page.select_option("#replace-question", "replace")
    page.click("#write-question")
    expect(page.locator("#message")).to_contain_text("written.toml is written and open")
    page.get_by_text("Edit the open card").click()
    text = page.get_by_label("Text of the card")
    text.fill(re.sub("P0_bar = .*", "P0_bar = { value = 0.85, std = 0.2 }", text.input_value()))
    page.get_by_label("Name of the edited card").fill("edited.toml")
    page.click("#write-entry")
    expect(page.locator("#message")).to_contain_text("edited.toml is written and open")
    expect(page.locator("#card-content")).to_contain_text("0.85 ± 0.2")


def test_a_blocked_step_leads_to_what_is_missing(shown: Page) -> None:
    page = shown
    for step in STEPS[1:]:
        show_view(page, step)
        head = page.locator(f"#step-{step}")
        expect(head).to_contain_text("Blocked: No log is open.", timeout=PATIENCE)
        expect(page.locator(f"#body-{step}")).to_be_hidden()
        head.get_by_role("button", name="Go to Log").click()
        expect(page.locator("#view-log")).to_be_visible()


def test_the_keyboard_reaches_every_view(shown: Page) -> None:
    page, seen = shown, []
    for _ in VIEWS:
        page.keyboard.press("Tab")
        page.keyboard.press("Enter")
        focused = page.evaluate("document.activeElement.id")
        seen.append(focused.removeprefix("nav-"))
        expect(page.locator(f"#view-{seen[-1]}")).to_be_visible()
        expect(page.locator(f"#{focused}")).to_have_attribute("aria-current", "page")
    assert tuple(seen) == VIEWS
