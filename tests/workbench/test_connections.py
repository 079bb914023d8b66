# SPDX-License-Identifier: MIT
"""A program without the link cannot use up the connections of the server."""

from __future__ import annotations

import http.client
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress

import pytest

from drivetwin.workbench import connections
from drivetwin.workbench.access_control import Access
from drivetwin.workbench.connections import MOST_CONNECTIONS
from drivetwin.workbench.server import build_server, start_server
from drivetwin.workbench.views.page import Start
from drivetwin.workbench.workspace_folder import Folder

HEAD = b"POST /upload/log HTTP/1.1\r\nHost: 127.0.0.1\r\n"


@pytest.fixture(scope="module")
def port(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """Port of a running server."""
    app, sessions = build_server(
        Folder.from_path(tmp_path_factory.mktemp("connections")), Start(), Access()
    )
    server = start_server(app, 0)
    thread = threading.Thread(target=server.serve_forever)
    thread.start()
    yield server.port
    server.shutdown()
    thread.join()
    sessions.close()


def _get_status(port: int) -> int:
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=30.0)
    connection.request("GET", "/")
    with connection.getresponse() as answer:
        return answer.status


@pytest.mark.parametrize("sent", [b"", b"GET /", HEAD, HEAD + b"Content-Length: 1000000\r\n\r\n"])
def test_a_slow_request_ends(port: int, sent: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    """One byte every 50 ms, of the head or of a body that nobody reads."""
    monkeypatch.setattr(connections, "HEAD_LIMIT", 0.5)
    begun = time.monotonic()
    with socket.create_connection(("127.0.0.1", port)) as connection:
        connection.sendall(sent)
        connection.settimeout(0.05)
        with suppress(ConnectionError):
            while time.monotonic() - begun < 10.0:
                connection.sendall(b"x")
                time.sleep(0.05)
    assert time.monotonic() - begun < 10.0


def test_idle_connections_keep_nobody_out(port: int) -> None:
    with ExitStack() as opened:
        for _ in range(3 * MOST_CONNECTIONS):
            opened.enter_context(socket.create_connection(("127.0.0.1", port)))
        assert _get_status(port) == 403
        running = [one.name for one in threading.enumerate() if "process_request" in one.name]
        assert len(running) <= MOST_CONNECTIONS
