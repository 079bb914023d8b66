# SPDX-License-Identifier: MIT
"""A real browser for pages: it fails a test on any request to the outside or console error."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright

from tests.browser.bench import NAMES, Bench, serve
from tests.browser.watch import Watch

PICTURES = Path(__file__).resolve().parents[2] / "out" / "browser"
"""Where tests leave their pictures, for people to look at."""


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """The distribution's Chromium; `make test-browser` installs it."""
    program = next(filter(None, map(shutil.which, NAMES)), None)
    if program is None:
        pytest.skip("no Chromium on this machine: run `make test-browser`")
    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield launched
        launched.close()


@pytest.fixture
def context(browser: Browser) -> Iterator[BrowserContext]:
    """A fresh context; a test may open several pages in it."""
    opened = browser.new_context(viewport={"width": 1280, "height": 1000})
    yield opened
    opened.close()


@pytest.fixture
def page(context: BrowserContext) -> Iterator[Page]:
    """A page that is watched: the test fails where it asks the outside or logs an error."""
    opened = context.new_page()
    watch = Watch(opened)
    yield opened
    assert watch.faults == []


@pytest.fixture(scope="session")
def pictures() -> Path:
    """Folder for screenshots."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    return PICTURES


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bench]:
    """A running workbench."""
    with serve(tmp_path_factory.mktemp("workbench")) as running:
        yield running


@pytest.fixture
def shown(page: Page, bench: Bench) -> Page:
    """The workbench in a page that may not complain."""
    return bench.shown(page)
