# SPDX-License-Identifier: MIT
"""The way of an engineer through the workbench, by mouse and keyboard, in a real browser."""

from __future__ import annotations

import http.client
import json
import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal
from urllib.parse import urlsplit

import pytest
from playwright.sync_api import Browser, BrowserContext, FloatRect, Locator, Page, Route, expect

from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from tests.browser.watch import Watch, grave_findings
from tests.workbench.bad_files import bad_files

pytestmark = [pytest.mark.browser, pytest.mark.timeout(600)]

ROOT = Path(__file__).resolve().parents[2]
GIVEN = ROOT.parent / "shared" / "logs" / "truck_a.csv"
PATIENCE = 120_000
"""Time [ms] that a step may take on a busy machine."""
VIEWS = ("log", "channels", "phases", "identify", "model", "compare", "gearbox", "export",
         "workspace")  # fmt: skip
SIMULATED = """() => Array.from(document.querySelector('#model-plot .js-plotly-plot')
    ._fullData.find((trace) => trace.name === 'simulated').y)"""
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


def _with_wrong_unit(log: Path) -> str:
    """Write `mbar` over the unit of the last pressure of a log; returns the column's name."""
    names, units, *rest = log.read_text().split("\n")
    columns, spelled = names.split(","), units.split(",")
    place = len(spelled) - 1 - spelled[::-1].index("bar")
    spelled[place] = "mbar"
    log.write_text("\n".join([names, ",".join(spelled), *rest]))
    return columns[place]


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    """The program in a folder with truck_a, or a synthetic log where that is absent."""
    folder = tmp_path_factory.mktemp("workbench")
    if GIVEN.exists():
        log, card = folder / "truck_a.csv", folder / "truck_a.toml"
        log.write_bytes(GIVEN.read_bytes())
        card.write_bytes((ROOT / "examples" / "vehicles" / "truck_a.toml").read_bytes())
    else:
        log, card, _ = write_run(folder / "bench.csv", run(load_scenario("paper_steps"), seed=1))
    wrong = _with_wrong_unit(log)
    command = [sys.executable, "-m", "drivetwin", "app", "--port", "0", "--no-browser"]
    server = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    told = server.stdout.readline()
    found = re.search(r"http://\S+/\?token=\S+", told)
    assert found, told
    yield Bench(found.group(), folder, log.name, card.name, wrong)
    server.terminate()
    server.wait(10.0)
    server.stdout.close()


@pytest.fixture
def shown(page: Page, bench: Bench) -> Page:
    """The workbench in a page that may not complain."""
    return bench.shown(page)


def _open(page: Page, bench: Bench) -> None:
    page.get_by_label("Log", exact=True).fill(bench.log)
    page.get_by_label("Vehicle card", exact=True).fill(bench.card)
    page.get_by_role("button", name="Open", exact=True).click()


def _view(page: Page, name: str) -> None:
    page.click(f"#nav-{name}")
    expect(page.locator(f"#view-{name}")).to_be_visible()


def _message(page: Page, text: str) -> None:
    expect(page.locator("#message")).to_contain_text(text)


def _correct_unit(page: Page, bench: Bench) -> None:
    _view(page, "channels")
    unit = page.get_by_label(f"unit of {bench.wrong}")
    expect(unit).to_have_value("mbar")
    unit.fill("bar")
    page.click("#apply-mapping")
    _message(page, "1 usable shift")


def _identify(page: Page) -> None:
    _view(page, "identify")
    page.click("#identify")
    expect(page.locator("#progress-box")).to_be_visible()
    expect(page.locator("#status")).to_contain_text("likelihood")
    expect(page.locator("#identify")).to_be_enabled(timeout=180_000)


def _at_rest(page: Page, thing: Locator) -> FloatRect:
    """Place of something once it has stopped moving: figures take their size after they show."""
    before = None
    while (present := thing.bounding_box()) is None or present != before:
        before = present
        page.wait_for_timeout(700)
    return present


def _drag_inertia_start(page: Page) -> tuple[float, float]:
    """Drag the line some pixels to the right; returns the time before and after."""
    _view(page, "phases")
    field = page.get_by_label("3 inertia phase starts [s]")
    before = float(field.input_value())
    line = page.locator("#phases-plot .shapelayer path[style*='cursor: move']").nth(INERTIA)
    box = _at_rest(page, line)
    x, y = box["x"] + box["width"] / 2, box["y"] + 0.25 * box["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 10, y, steps=5)  # less than 8 pixels are taken for a click
    page.mouse.up()
    _message(page, "3 inertia phase starts at")
    expect(field).not_to_have_value(f"{before:g}")
    return before, float(field.input_value())


@pytest.mark.short
def test_from_a_log_to_a_saved_and_reopened_model(
    shown: Page, bench: Bench, browser: Browser, pictures: Path, tmp_path: Path
) -> None:
    page = shown
    _open(page, bench)
    expect(page.locator("#log-content")).to_contain_text("No usable shift")
    _correct_unit(page, bench)
    before, after = _drag_inertia_start(page)
    assert 0.0 < after - before < 0.1
    _identify(page)

    _view(page, "model")
    page.wait_for_selector("#model-plot .js-plotly-plot")
    identified = page.evaluate(SIMULATED)
    slider = page.get_by_label("k_o, slider")
    slider.focus()
    for _ in range(20):
        page.keyboard.press("ArrowLeft")
    expect(page.locator("#model-fit")).to_contain_text("simulated and compared in")
    page.wait_for_function(f"(old) => JSON.stringify(({SIMULATED})()) !== old",
                           arg=json.dumps(identified))  # fmt: skip
    page.wait_for_timeout(1000)
    moved = page.evaluate(SIMULATED)
    assert max(abs(a - b) for a, b in zip(moved, identified, strict=False)) > 1.0
    stiffness = slider.input_value()

    _view(page, "export")
    for button in ("DCM", "C sources", "Report"):
        with page.expect_download() as handed:
            page.get_by_role("button", name=re.compile(f"^{button}")).click()
        handed.value.save_as(tmp_path / handed.value.suggested_filename)
    assert "FESTWERT" in next(tmp_path.glob("*.dcm")).read_text(errors="replace")
    _report_picture(browser, next(tmp_path.glob("*.report.html")), pictures)

    _view(page, "workspace")
    page.get_by_label("Name").fill("session")
    page.get_by_role("button", name="Save", exact=True).click()
    _message(page, "saved as session.workspace.json")
    assert (bench.folder / "session.workspace.json").exists()
    _reopened(browser, bench, (after, stiffness, moved))


def _reopened(browser: Browser, bench: Bench, state: tuple[float, str, list[float]]) -> None:
    """Another user reopens the workspace and finds phase, slider and curve."""
    context = browser.new_context()
    page = context.new_page()
    watch = Watch(page)
    bench.shown(page)
    expect(page.locator("#status")).to_contain_text("no log is open")
    _view(page, "workspace")
    page.get_by_label("Workspace", exact=True).fill("session.workspace.json")
    page.get_by_role("button", name="Reopen", exact=True).click()
    _message(page, "is reopened")
    after, stiffness, moved = state
    _view(page, "phases")
    field = page.get_by_label("3 inertia phase starts [s]")
    assert float(field.input_value()) == pytest.approx(after, abs=1e-4)
    _view(page, "model")
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


def test_each_view_is_accessible_in_light_and_dark(
    shown: Page, bench: Bench, pictures: Path
) -> None:
    page = shown
    _open(page, bench)
    _correct_unit(page, bench)
    _view(page, "identify")
    page.select_option("#methods", "integral")
    page.click("#identify")
    expect(page.locator("#status")).to_contain_text("integral")
    _view(page, "gearbox")
    page.click("#show-gearbox")
    page.wait_for_selector("#reduction table")
    schemes: tuple[Literal["light", "dark"], ...] = ("light", "dark")
    findings = {}
    for scheme in schemes:
        page.emulate_media(color_scheme=scheme)
        for name in VIEWS:
            _view(page, name)
            page.wait_for_timeout(300)
            page.screenshot(path=pictures / f"workbench-{name}-{scheme}.png")
            only = () if scheme == "light" else ("color-contrast",)
            findings[scheme, name] = grave_findings(page, *only)
    assert {place: found for place, found in findings.items() if found} == {}


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


_BUSY_CLICKS = """ids => ids.forEach((id) => {
  const begin = Date.now();
  while (Date.now() < begin + 5);
  document.getElementById(id).click();
})"""
"""Clicks, 5 ms apart, on a page that is busy until after the last."""


def test_the_way_back_and_loading_again_keep_to_the_views(shown: Page) -> None:
    page = shown
    for name in ("channels", "phases"):
        _view(page, name)
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
    for names in (("channels", "model"), ("export", "log"), ("model", "channels", "gearbox")):
        shown.evaluate(_BUSY_CLICKS, [f"nav-{name}" for name in names])
        expect(shown.locator(f"#view-{names[-1]}")).to_be_visible()


@pytest.fixture
def refusing(context: BrowserContext, bench: Bench) -> Page:
    """The workbench in a page whose console tells of refused requests, as browsers do."""
    return bench.shown(context.new_page())


def test_bad_uploads_are_refused_with_a_message(refusing: Page, bench: Bench) -> None:
    page = refusing
    page.get_by_label("Vehicle card", exact=True).fill(bench.card)
    message = page.locator("#message")
    plain = {
        kind: bad for kind, bad in bad_files().items() if re.fullmatch(r"[\w.]{1,99}", bad.name)
    }
    assert len(plain) >= 18
    for kind, bad in plain.items():
        page.evaluate("dash_clientside.set_props('message', {children: '', className: 'message'})")
        with page.expect_file_chooser() as choosing:
            page.get_by_role("button", name="Upload a log…").click()
        choosing.value.set_files(
            {"name": bad.name, "mimeType": "application/octet-stream", "buffer": bad.content}
        )
        expect(message).to_contain_text(re.compile("->|uploaded"))
        if message.inner_text().startswith("uploaded"):
            page.get_by_role("button", name="Open", exact=True).click()
        expect(message, kind).to_have_class("message fault")
        expect(message, kind).to_contain_text("->")
    _open(page, bench)
    _message(page, "is open")


def test_a_message_goes_with_the_next_thing_that_is_done(shown: Page, bench: Bench) -> None:
    page, message = shown, shown.locator("#message")
    _open(page, bench)
    expect(message).to_have_class("message fault")
    _view(page, "channels")
    expect(message).to_be_empty()
    page.get_by_label(f"unit of {bench.wrong}").fill("furlong")
    page.click("#apply-mapping")
    expect(message).to_have_class("message fault")
    page.get_by_label(f"unit of {bench.wrong}").fill("bar")
    page.click("#apply-mapping")
    _message(page, "1 usable shift")
    _view(page, "model")
    expect(message).to_be_empty()
    value = page.get_by_label(re.compile("locked value of .*B3"))
    stated = value.input_value()
    for typed, told in (("-1", "lies outside"), (stated, "")):
        value.fill(typed)
        page.keyboard.press("Enter")
        expect(message).to_have_text(re.compile(told) if told else "")


def test_a_typed_time_of_any_detail_counts(shown: Page, bench: Bench) -> None:
    page = shown
    _open(page, bench)
    _correct_unit(page, bench)
    _view(page, "phases")
    field = page.get_by_label("3 inertia phase starts [s]")
    typed = f"{float(field.input_value()) + 0.01234:.5f}"
    field.fill(typed)
    page.get_by_role("button", name="Apply times").click()
    _message(page, "The phases are set")
    expect(field).to_have_value(f"{float(typed):.4f}")
    about = page.locator("#phases-content .notes")
    expect(about).to_contain_text("Boundary 3 inertia phase starts is set by hand")


@pytest.mark.parametrize(
    ("answer", "told"), [(None, "does not answer"), (500, "met a fault of its own")]
)
def test_a_server_that_fails_is_told(refusing: Page, answer: int | None, told: str) -> None:
    def fail(route: Route) -> None:
        route.abort() if answer is None else route.fulfill(status=answer)

    refusing.route("**/_dash-update-component*", fail)
    _view(refusing, "phases")
    _message(refusing, told)


@pytest.mark.parametrize(
    "name", ["../../log.csv", "..%5C..%5Clog.csv", "/etc/passwd", "log%0A.csv"]
)
def test_names_that_are_paths_are_refused(refusing: Page, name: str) -> None:
    answer = refusing.evaluate(
        """async (name) => {
          const key = JSON.parse(sessionStorage.getItem("session"));
          const headers = { "X-Drivetwin-Session": key };
          const url = `upload/log?name=${name}`;
          return (await fetch(url, { method: "POST", body: "x", headers })).json();
        }""",
        name,
    )
    assert "no plain file name" in answer["error"]


def test_a_claim_of_two_gigabytes_is_refused_at_once(bench: Bench, refusing: Page) -> None:
    key = json.loads(refusing.evaluate("sessionStorage.getItem('session')"))
    place = urlsplit(bench.address)
    connection = http.client.HTTPConnection(place.netloc, timeout=30.0)
    connection.putrequest("POST", "/upload/log?name=log.mf4")
    connection.putheader("Content-Length", str(2 * 10**9))
    connection.putheader("X-Drivetwin-Session", key)
    connection.putheader("Cookie", place.query.replace("token=", "drivetwin-token="))
    connection.endheaders(b"MDF     ")
    answer = connection.getresponse()
    assert answer.status == 400
    assert "2000 MB" in json.loads(answer.read())["error"]
    connection.close()
