# SPDX-License-Identifier: MIT
"""Access: the own address and the link with its token; no route answers anybody else."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from flask.testing import FlaskClient

from drivetwin.workbench.access_control import Access, is_loopback, is_own_host
from drivetwin.workbench.server import build_server
from drivetwin.workbench.views.page import Start
from drivetwin.workbench.workspace_folder import Folder

HERE = "http://127.0.0.1:8050"
ROUTES = (
    "/",
    "/?token=",
    "/?token=wrong",
    "/_dash-layout",
    "/_dash-dependencies",
    "/_dash-update-component",
    "/_favicon.ico",
    "/assets/controls.js",
    "/assets/workbench.css",
    "/upload/log",
    "/anything/else",
)


@pytest.mark.parametrize(
    "named", ["127.0.0.1:8050", "localhost:8050", "127.0.0.1", "[::1]:8050", "127.1.2.3:1"]
)
def test_own_names_on_loopback(named: str) -> None:
    assert is_own_host(named, "127.0.0.1")


@pytest.mark.parametrize(
    "named",
    ["evil.example", "evil.example:8050", "localhost.evil.example", "192.168.1.5:8050", "",
     "127.0.0.1.nip.io", "0.0.0.0:8050", "[", "[::1", "127.0.0.1@evil.example", "user@evil:1"],
)  # fmt: skip
def test_foreign_names_on_loopback(named: str) -> None:
    assert not is_own_host(named, "127.0.0.1")


def test_on_the_network_addresses_and_the_stated_name_count() -> None:
    assert is_own_host("192.168.1.5:8050", "0.0.0.0")
    assert is_own_host("bench7:8050", "bench7")
    assert not is_own_host("evil.example", "0.0.0.0")
    assert not is_own_host("evil.example", "bench7")


@pytest.mark.parametrize(
    ("host", "own"),
    [("127.0.0.1", True), ("::1", True), ("localhost", True), ("0.0.0.0", False), ("::", False),
     ("192.168.1.5", False), ("bench7", False)],
)  # fmt: skip
def test_what_only_this_machine_reaches(host: str, own: bool) -> None:
    assert is_loopback(host) is own


@pytest.fixture
def client(place: Path) -> Iterator[FlaskClient]:
    """A browser that has not opened the link."""
    app, sessions = build_server(Folder.from_path(place), Start(), Access(token="right"))
    yield app.server.test_client()
    sessions.close()


@pytest.mark.parametrize("method", ["GET", "POST", "PUT", "DELETE", "OPTIONS", "HEAD"])
@pytest.mark.parametrize("route", ROUTES)
def test_no_route_answers_without_the_token(client: FlaskClient, route: str, method: str) -> None:
    answer = client.open(route, method=method, base_url=HERE)
    assert answer.status_code == 403
    assert "Set-Cookie" not in answer.headers


@pytest.mark.parametrize(
    "cookie", ["", "wrong", "right ", "RIGHT", "rightright", "\u00e9", "x" * 9999]
)
def test_another_cookie_is_refused(client: FlaskClient, cookie: str) -> None:
    headers = {"Cookie": f"drivetwin-token={cookie}"}
    assert client.get("/", base_url=HERE, headers=headers).status_code == 403


@pytest.mark.parametrize(
    "headers", [{}, {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}]
)
def test_the_link_opens_the_page(client: FlaskClient, headers: dict[str, str]) -> None:
    answer = client.get("/?token=right", base_url=HERE, headers=headers)
    assert answer.status_code == 302
    assert answer.headers["Location"] == "/"
    assert "HttpOnly" in answer.headers["Set-Cookie"]
    for route in ("/", "/assets/controls.js", "/_dash-layout"):
        with client.get(route, base_url=HERE) as page:
            assert page.status_code == 200


def test_the_token_is_new_each_time_and_in_no_log() -> None:
    one, other = Access(), Access()
    assert one.token != other.token
    assert len(one.token) >= 43
    assert one.token not in repr(one)
    assert one.make_link(8050) == f"{HERE}/?token={one.token}"
    assert Access("::1", "t").make_link(1) == "http://[::1]:1/?token=t"


def test_who_may_connect_is_described() -> None:
    assert "this machine only" in Access().describe()
    assert "every machine that reaches 0.0.0.0" in Access("0.0.0.0").describe()
