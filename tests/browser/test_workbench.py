# SPDX-License-Identifier: MIT
"""The way of an engineer through the workbench, by mouse and keyboard, in a real browser."""

from __future__ import annotations

import json
import re
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, Route, expect

from tests.browser.bench import (
    PATIENCE,
    VIEWS,
    Bench,
    correct_unit,
    drag_inertia_start,
    expect_message,
    identify,
    open_files,
    serve_folder,
    show_view,
)
from tests.browser.watch import Watch
from tests.workbench.bad_files import bad_files

pytestmark = [pytest.mark.browser, pytest.mark.timeout(600)]

SIMULATED = """() => Array.from(document.querySelector('#model-plot .js-plotly-plot')
    ._fullData.find((trace) => trace.name === 'simulated').y)"""


@pytest.mark.short
def test_from_a_log_to_a_saved_and_reopened_model(
    shown: Page, bench: Bench, browser: Browser, pictures: Path, tmp_path: Path
) -> None:
    page = shown
    open_files(page, bench)
    show_view(page, "shifts")
    expect(page.locator("#shifts-content")).to_contain_text("No usable shift")
    correct_unit(page, bench)
    before, after = drag_inertia_start(page)
    assert 0.0 < after - before < 0.1
    identify(page)

    show_view(page, "model")
    page.wait_for_selector("#model-plot .js-plotly-plot")
    identified = page.evaluate(SIMULATED)
    slider = page.get_by_label("k_o, slider")
    slider.focus()
    for _ in range(20):
        page.keyboard.press("ArrowLeft")
    page.wait_for_function(f"(old) => JSON.stringify(({SIMULATED})()) !== old",
                           arg=json.dumps(identified))  # fmt: skip
    page.wait_for_timeout(1000)
    moved = page.evaluate(SIMULATED)
    assert max(abs(a - b) for a, b in zip(moved, identified, strict=False)) > 1.0
    stiffness = slider.input_value()

    show_view(page, "export")
    for button in ("DCM", "C sources", "Report"):
        with page.expect_download() as handed:
            page.get_by_role("button", name=re.compile(f"^{button}")).click()
        handed.value.save_as(tmp_path / handed.value.suggested_filename)
    assert "FESTWERT" in next(tmp_path.glob("*.dcm")).read_text(errors="replace")
    _report_picture(browser, next(tmp_path.glob("*.report.html")), pictures)

    show_view(page, "workspace")
    page.get_by_label("Name", exact=True).fill("session")
    page.get_by_role("button", name="Save", exact=True).click()
    expect_message(page, "saved as session.workspace.json")
    assert (bench.folder / "session.workspace.json").exists()
    _reopened(browser, bench, (after, stiffness, moved))


def _reopened(browser: Browser, bench: Bench, state: tuple[float, str, list[float]]) -> None:
    """Another user reopens the workspace and finds phase, slider and curve."""
    context = browser.new_context()
    page = context.new_page()
    watch = Watch(page)
    bench.shown(page)
    expect(page.locator("#status")).to_contain_text("no log is open")
    show_view(page, "workspace")
    page.get_by_label("Workspace", exact=True).fill("session.workspace.json")
    page.get_by_role("button", name="Reopen", exact=True).click()
    expect_message(page, "is reopened")
    after, stiffness, moved = state
    show_view(page, "shifts")
    field = page.get_by_label("3 inertia phase starts [s]")
    assert float(field.input_value()) == pytest.approx(after, abs=1e-4)
    show_view(page, "model")
    page.wait_for_selector("#model-plot .js-plotly-plot")
    assert page.get_by_label("k_o, slider").input_value() == stiffness
    assert page.evaluate(SIMULATED) == pytest.approx(moved, rel=1e-4, abs=1.0)
    assert watch.faults == []
    context.close()


def _report_picture(browser: Browser, report: Path, pictures: Path) -> None:
    context = browser.new_context(viewport={"width": 1440, "height": 1000}, offline=True)
    page = context.new_page()
    watch = Watch(page)
    page.goto(report.as_uri())
    page.wait_for_selector("body[data-drawn]", state="attached", timeout=PATIENCE)
    page.screenshot(path=pictures / "workbench-report.png")
    assert watch.faults == []
    context.close()


_RECORD_MESSAGES = """
window.messages = [];
new MutationObserver(() => {
  const shown = document.getElementById("message");
  if (shown?.textContent) window.messages.push(shown.textContent);
}).observe(document, { childList: true, characterData: true, subtree: true });
"""


@pytest.mark.parametrize("held", ["", "of-a-run-that-ended"])
def test_the_first_opening_shows_no_message(browser: Browser, tmp_path: Path, held: str) -> None:
    """Neither in a browser that has never opened the page, nor in a tab of an earlier run."""
    context = browser.new_context()
    page = context.new_page()
    page.add_init_script(_RECORD_MESSAGES)
    if held:
        page.add_init_script(f"sessionStorage.session ??= '{json.dumps(held)}'")
    with serve_folder(tmp_path) as address:
        page.goto(address)
        expect(page.locator("#status")).to_contain_text("no log is open")
        for _ in range(2):
            for name in VIEWS:
                show_view(page, name)
            page.wait_for_load_state("networkidle")
            assert page.evaluate("window.messages") == []
            page.reload()
            expect(page.locator("#status")).to_contain_text("no log is open")
    context.close()


_BUSY_CLICKS = """ids => ids.forEach((id) => {
  const begin = Date.now();
  while (Date.now() < begin + 5);
  document.getElementById(id).click();
})"""
"""Clicks, 5 ms apart, on a page that is busy until after the last."""


def test_the_way_back_and_loading_again_keep_to_the_views(shown: Page) -> None:
    page = shown
    for name in ("channels", "shifts"):
        show_view(page, name)
    page.go_back()
    expect(page.locator("#view-channels")).to_be_visible()
    page.reload()
    expect(page.locator("#view-channels")).to_be_visible()
    expect(page.locator("#nav-channels")).to_have_attribute("aria-current", "page")
    page.go_back()
    expect(page.locator("#view-log")).to_be_visible()
    page.go_forward()
    expect(page.locator("#view-channels")).to_be_visible()


def test_of_clicks_in_a_row_the_last_one_counts(shown: Page) -> None:
    for names in (("channels", "model"), ("export", "log"), ("model", "channels", "workspace")):
        shown.evaluate(_BUSY_CLICKS, [f"nav-{name}" for name in names])
        expect(shown.locator(f"#view-{names[-1]}")).to_be_visible()


@pytest.fixture
def refusing(context: BrowserContext, bench: Bench) -> Page:
    """The workbench in a page whose console tells of refused requests, as browsers do."""
    return bench.shown(context.new_page())


def test_bad_uploads_are_refused_with_a_message(refusing: Page, bench: Bench) -> None:
    page = refusing
    message = page.locator("#message")
    plain = bad_files()
    for kind in ("empty", "picture", "gzip bomb"):
        bad = plain[kind]
        page.evaluate("dash_clientside.set_props('message', {children: '', className: 'message'})")
        with page.expect_file_chooser() as choosing:
            page.get_by_role("button", name="Upload a log…").click()
        choosing.value.set_files(
            {"name": bad.name, "mimeType": "application/octet-stream", "buffer": bad.content}
        )
        expect(message, kind).to_have_class("message fault")
        expect(message, kind).to_contain_text("->")
    open_files(page, bench)


def test_a_message_goes_with_the_next_thing_that_is_done(shown: Page, bench: Bench) -> None:
    page, message = shown, shown.locator("#message")
    open_files(page, bench)
    expect(message).to_have_class("message fault")
    show_view(page, "channels")
    expect(message).to_be_empty()
    page.get_by_label(f"unit of {bench.wrong}").fill("furlong")
    page.click("#apply-mapping")
    expect(message).to_have_class("message fault")
    page.get_by_label(f"unit of {bench.wrong}").fill("bar")
    page.click("#apply-mapping")
    expect_message(page, "1 usable shift")
    show_view(page, "identify")
    expect(message).to_be_empty()
    page.get_by_text("Known values of parameters").click()
    value = page.get_by_label(re.compile("locked value of .*B3"))
    stated = value.input_value()
    for typed, reported in (("-1", "lies outside"), (stated, "")):
        value.fill(typed)
        page.keyboard.press("Enter")
        expect(message).to_have_text(re.compile(reported) if reported else "")


def test_a_typed_time_of_any_detail_counts(shown: Page, bench: Bench) -> None:
    page = shown
    open_files(page, bench)
    correct_unit(page, bench)
    show_view(page, "shifts")
    field = page.get_by_label("3 inertia phase starts [s]")
    typed = f"{float(field.input_value()) + 0.01234:.5f}"
    field.fill(typed)
    page.get_by_role("button", name="Apply times").click()
    expect_message(page, "The phases are set")
    expect(field).to_have_value(f"{float(typed):.4f}")
    about = page.locator("#phases-content .notes")
    expect(about).to_contain_text("Boundary 3 inertia phase starts is set by hand")


def test_two_workbenches_in_one_browser(
    context: BrowserContext, bench: Bench, tmp_path: Path
) -> None:
    """Both go on, and neither link is in a cookie, which browsers send to all ports of a host."""
    first = bench.shown(context.new_page())
    with serve_folder(tmp_path) as address:
        second = context.new_page()
        second.goto(address)
        expect(second.locator("#status")).to_contain_text("no log is open")
        for page in (first, second, first):
            page.reload()
            page.get_by_role("button", name="Open the sample").click()
            expect_message(page, "The sample is open with its card")
        names = {cookie["name"] for cookie in context.cookies()}
        assert {f"drivetwin-{urlsplit(one).port}" for one in (bench.address, address)} <= names
        reported = str(context.cookies()) + first.url + second.url
        assert not any(urlsplit(one).query[6:] in reported for one in (bench.address, address))
        assert first.evaluate("localStorage['drivetwin-key']") != second.evaluate(
            "localStorage['drivetwin-key']"
        )
        again = context.new_page()
        again.goto(address.partition("?")[0])
        expect(again.locator("#status")).to_contain_text("no log is open")


def test_a_tab_that_is_loaded_again_keeps_its_work(
    context: BrowserContext, shown: Page, bench: Bench
) -> None:
    shown.get_by_role("button", name="Open the sample").click()
    expect_message(shown, "The sample is open with its card")
    identify(shown)
    bench.shown(tab := context.new_page())
    tab.close()
    shown.reload()
    expect(shown.locator("#status")).to_contain_text("identified")


@pytest.mark.parametrize(("answer", "text"), [(None, "does not answer"), (500, "internal error")])
def test_a_failing_server_is_reported(refusing: Page, answer: int | None, text: str) -> None:
    def fail(route: Route) -> None:
        route.abort() if answer is None else route.fulfill(status=answer)

    refusing.route("**/_dash-update-component*", fail)
    show_view(refusing, "shifts")
    expect_message(refusing, text)
