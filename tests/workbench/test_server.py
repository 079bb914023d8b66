# SPDX-License-Identifier: MIT
"""The server by its requests: bad uploads refused, strangers refused, nothing from outside."""

from __future__ import annotations

import re
import socket
import threading
from collections.abc import Callable
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from flask.testing import FlaskClient

from drivetwin.errors import DrivetwinError
from drivetwin.workbench.server import start_server
from tests.workbench.bad_files import TABLE, bad_files
from tests.workbench.conftest import CARD, enter

BAD = bad_files()
TOKEN = "secret"
SESSION_HEADER = "X-Drivetwin-Session"


@dataclass(frozen=True)
class Bench:
    """A server without a socket, its sessions, and one of them."""

    client: FlaskClient
    app: Any
    sessions: Any
    key: str

    def upload(self, name: str, content: bytes, purpose: str = "log", **more: Any) -> Any:
        return self.client.post(
            f"/upload/{purpose}",
            query_string={"name": name},
            input_stream=BytesIO(content),
            headers={SESSION_HEADER: self.key, **more.pop("headers", {})},
            environ_overrides={"CONTENT_LENGTH": str(more.pop("content_length", len(content)))},
            base_url=more.pop("base_url", "http://127.0.0.1:8050"),
        )

    def page(self) -> Any:
        return self.client.get("/", base_url="http://127.0.0.1:8050")

    @property
    def session(self) -> Any:
        return self.sessions.get(self.key)


@pytest.fixture(scope="module")
def bench(place: Path, serve: Callable[..., Any]) -> Bench:
    app, sessions = serve(place, TOKEN)
    client = app.server.test_client()
    enter(client, TOKEN)
    return Bench(client, app, sessions, sessions.create())


@pytest.mark.parametrize("kind", BAD)
def test_a_bad_upload_is_refused_with_a_message_and_the_server_stays(
    bench: Bench, kind: str
) -> None:
    bad = BAD[kind]
    answer = bench.upload(bad.name, bad.content)
    message = answer.json.get("error") or _opened(bench.session, answer.json["key"])
    assert "->" in message
    assert bench.page().status_code == 200


def _opened(session: Any, key: str) -> str:
    """What opening an upload is answered with."""
    try:
        session.open(session.get_uploaded(key), session.get_folder_source(CARD))
    except DrivetwinError as error:
        return str(error)
    opened = session.work.require_opened()
    assert opened.log is None
    return str(opened.fault)


def test_a_claim_of_two_gigabytes_is_refused_unread(bench: Bench) -> None:
    answer = bench.upload("log.csv", b"x", content_length=2 * 10**9)
    assert answer.status_code == 400
    assert "2000 MB" in answer.json["error"]
    assert bench.page().status_code == 200


def test_each_purpose_has_its_limit(bench: Bench) -> None:
    answer = bench.upload("card.toml", b"x" * 5 * 2**20, "card")
    assert answer.status_code == 400
    assert bench.upload("x", b"x", "anything").status_code == 404


@pytest.mark.parametrize("key", ["", "x", "../x"])
def test_an_upload_needs_a_session(bench: Bench, key: str) -> None:
    answer = bench.upload("log.csv", TABLE, headers={SESSION_HEADER: key})
    assert answer.status_code == 400
    assert "session" in answer.json["error"]


@pytest.mark.parametrize(
    "headers",
    [{"Host": "evil.example"}, {"Origin": "http://evil.example"}, {"Sec-Fetch-Site": "cross-site"},
     {"Origin": "null"}],
)  # fmt: skip
def test_strangers_are_refused(bench: Bench, headers: dict[str, str]) -> None:
    answer = bench.upload("log.csv", TABLE, headers=headers)
    assert answer.status_code in (403, 421)
    assert answer.json["error"]


def test_a_request_that_is_no_upload_is_bounded(bench: Bench) -> None:
    answer = bench.client.post(
        "/_dash-update-component",
        data=b"{" + b" " * (5 * 2**20),
        content_type="application/json",
        base_url="http://127.0.0.1:8050",
    )
    assert answer.status_code == 413


def test_the_page_loads_from_here_alone(bench: Bench) -> None:
    answer = bench.page()
    assert not re.findall(rb"""(?:src|href)=["'](?:https?:)?//""", answer.data)
    policy = answer.headers["Content-Security-Policy"]
    assert "default-src 'self'" in policy
    assert "unsafe-eval" not in policy
    assert "'unsafe-inline'" not in policy.split("script-src")[1].split(";")[0]


@pytest.mark.parametrize(
    "path", ["/assets/../server.py", "/assets/%2e%2e/server.py", "/upload/log"]
)
def test_files_of_the_program_are_not_served(bench: Bench, path: str) -> None:
    answer = bench.client.get(path, base_url="http://127.0.0.1:8050")
    assert b"SPDX" not in answer.data


@pytest.mark.parametrize("path", ["dash/nothing.js", "nothing/x.js", "dash/../server.py"])
def test_a_library_path_that_does_not_exist_is_not_found(bench: Bench, path: str) -> None:
    address = f"/_dash-component-suites/{path}"
    answer = bench.client.get(address, base_url="http://127.0.0.1:8050")
    assert answer.status_code == 404


def test_uploads_of_one_session_are_unknown_to_another(bench: Bench) -> None:
    key = bench.upload("log.csv", TABLE).json["key"]
    other = bench.sessions.get(bench.sessions.create())
    assert bench.session.get_uploaded(key).name == "log.csv"
    with pytest.raises(DrivetwinError):
        other.get_uploaded(key)


def test_an_idle_connection_ends(bench: Bench) -> None:
    server = start_server(bench.app, 0)
    handler: Any = server.RequestHandlerClass
    assert 1.0 < handler.timeout < 60.0
    server.RequestHandlerClass = type("Hasty", (handler,), {"timeout": 0.2})
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    for sent in (b"", b"GET /"):
        with socket.create_connection(("127.0.0.1", server.port), timeout=10.0) as connection:
            connection.sendall(sent)
            assert connection.recv(1) == b""
    server.shutdown()
    thread.join()
    server.server_close()
