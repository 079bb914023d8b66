# SPDX-License-Identifier: MIT
"""A folder with a synthetic log and its card, and a session that has identified it."""

from __future__ import annotations

import re
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from flask.testing import FlaskClient

from drivetwin.cli import main
from drivetwin.workbench.access_control import Access
from drivetwin.workbench.server import build_server
from drivetwin.workbench.session import Sessions
from drivetwin.workbench.views.page import Start
from drivetwin.workbench.workspace import Folder

LOG, CARD = "bench.csv", "bench.card.toml"


@pytest.fixture(scope="session")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with `bench.csv` and its card."""
    folder = tmp_path_factory.mktemp("workbench")
    arguments = ["--scenario", "paper_steps", "--seed", "1"]
    assert main(["synth", "-o", str(folder / LOG), *arguments]) == 0
    return folder


@pytest.fixture
def session(place: Path) -> Iterator[Any]:
    """A session in which nothing is open."""
    sessions = Sessions(Folder.from_path(place))
    yield sessions.get(sessions.create())
    sessions.close()


@pytest.fixture(scope="session")
def identified(place: Path) -> Iterator[Any]:
    """A session that has identified the log by one model."""
    sessions = Sessions(Folder.from_path(place))
    one = sessions.get(sessions.create())
    one.open(one.get_folder_source(LOG), one.get_folder_source(CARD))
    one.identify(is_quick=True)
    finish(one)
    yield one
    sessions.close()


@pytest.fixture(scope="module")
def serve() -> Iterator[Callable[..., Any]]:
    """Return application and sessions of a server of a folder, whose link has a token."""
    begun: list[Sessions] = []

    def build(folder: Path, token: str = "right") -> tuple[Any, Sessions]:
        app, sessions = build_server(Folder.from_path(folder), Start(), Access(token=token))
        begun.append(sessions)
        return app, sessions

    yield build
    for sessions in begun:
        sessions.close()


def finish(session: Any) -> None:
    """Wait for the job of a session."""
    while session.job is not None:
        session.collect_job_results()
        time.sleep(0.02)


def enter(client: FlaskClient, token: str, base_url: str = "http://127.0.0.1:8050") -> None:
    """Open the link as a browser does: keep the cookie, and send the key with every request."""
    answer = client.get(f"/?token={token}", base_url=base_url)
    found = re.search(r"#key=([\w-]+)", answer.text)
    assert found, answer.text
    client.environ_base["HTTP_X_DRIVETWIN_KEY"] = found.group(1)
