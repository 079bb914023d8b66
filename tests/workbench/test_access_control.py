# SPDX-License-Identifier: MIT
"""Access: the own address and the link with its token; no route answers anybody else."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from flask.testing import FlaskClient

from drivetwin.workbench.access_control import KEY_HEADER, Access, is_own_host
from tests.workbench.conftest import enter

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
def test_own_names(named: str) -> None:
    assert is_own_host(named)


@pytest.mark.parametrize(
    "named",
    ["evil.example", "evil.example:8050", "localhost.evil.example", "192.168.1.5:8050", "",
     "127.0.0.1.nip.io", "0.0.0.0:8050", "127.0.0.1:x", "127.0.0.1:99999",
     "[", "[::1", "127.0.0.1@evil.example", "user@evil:1"],
)  # fmt: skip
def test_foreign_names(named: str) -> None:
    assert not is_own_host(named)


@pytest.fixture
def client(place: Path, serve: Callable[..., Any]) -> FlaskClient:
    """A browser that has not opened the link."""
    made: FlaskClient = serve(place)[0].server.test_client()
    return made


@pytest.mark.parametrize("method", ["GET", "POST", "PUT", "DELETE", "OPTIONS", "HEAD"])
@pytest.mark.parametrize("route", ROUTES)
def test_no_route_answers_without_the_token(client: FlaskClient, route: str, method: str) -> None:
    answer = client.open(route, method=method, base_url=HERE)
    assert answer.status_code == 403
    assert "Set-Cookie" not in answer.headers


@pytest.mark.parametrize("name", ["drivetwin-token", "drivetwin-8050"])
@pytest.mark.parametrize(
    "cookie", ["", "right", "wrong", "right ", "RIGHT", "rightright", "\u00e9", "x" * 9999]
)
def test_another_cookie_is_refused(client: FlaskClient, cookie: str, name: str) -> None:
    enter(client.application.test_client(), "right")
    headers = {"Cookie": f"{name}={cookie}"}
    assert client.get("/", base_url=HERE, headers=headers).status_code == 403


@pytest.mark.parametrize(
    "headers", [{}, {"Sec-Fetch-Site": "cross-site", "Sec-Fetch-Mode": "navigate"}]
)
def test_the_link_opens_the_page(client: FlaskClient, headers: dict[str, str]) -> None:
    answer = client.get("/?token=right", base_url=HERE, headers=headers)
    assert answer.status_code == 200
    assert answer.headers["Cache-Control"] == "no-store"
    set_cookie = answer.headers["Set-Cookie"]
    assert set_cookie.startswith("drivetwin-8050=")
    assert "HttpOnly" in set_cookie
    assert "SameSite=Strict" in set_cookie
    for route in ("/", "/assets/controls.js", "/_dash-layout"):
        with client.get(route, base_url=HERE) as page:
            assert page.status_code == 200


def test_cookie_and_key_are_not_the_token(client: FlaskClient) -> None:
    answer = client.get("/?token=right", base_url=HERE)
    assert "right" not in str(answer.headers) + answer.text
    found = re.findall(r"#key=([\w-]+)\"><", answer.text)
    found += re.findall(r"drivetwin-8050=([\w-]+)", answer.headers["Set-Cookie"])
    assert len(set(found)) == 2
    assert min(map(len, found)) >= 43


def test_the_cookie_alone_reads_no_data(client: FlaskClient) -> None:
    """A program on another port receives the cookie, yet no page of it has the key."""
    enter(client, "right")
    key = client.environ_base.pop("HTTP_X_DRIVETWIN_KEY")
    for route in ("/upload/log", "/_dash-update-component"):
        for given in ({}, {KEY_HEADER: ""}, {KEY_HEADER: "right"}, {KEY_HEADER: "\u00e9"}):
            answer = client.post(route, base_url=HERE, headers=given, json={})
            assert answer.status_code == 403
        answer = client.post(route, base_url=HERE, headers={KEY_HEADER: key}, json={})
        assert answer.status_code != 403
    client.delete_cookie("drivetwin-8050", domain="127.0.0.1")
    answer = client.post("/upload/log", base_url=HERE, headers={KEY_HEADER: key})
    assert answer.status_code == 403


def test_get_serves_no_data(client: FlaskClient) -> None:
    """The cookie alone is enough for these routes: files of the program and the empty page."""
    rules = client.application.url_map.iter_rules()
    assert {str(rule) for rule in rules if "GET" in (rule.methods or ())} == {
        "/", "/<path:path>", "/_dash-layout", "/_dash-dependencies", "/_reload-hash",
        "/_favicon.ico", "/assets/<path:filename>", "/static/<path:filename>",
        "/_dash-component-suites/<string:package_name>/<path:fingerprinted_path>",
    }  # fmt: skip


def test_two_workbenches_in_one_browser(
    client: FlaskClient, place: Path, serve: Callable[..., Any]
) -> None:
    """Cookies of a host go to all its ports; each workbench finds its own and no other counts."""
    there = "http://127.0.0.1:8051"
    second = serve(place, "other")[0].server.test_client()
    enter(client, "right")
    enter(second, "other", there)
    first_cookie = client.get_cookie("drivetwin-8050", domain="127.0.0.1")
    second_cookie = second.get_cookie("drivetwin-8051", domain="127.0.0.1")
    assert first_cookie is not None
    assert second_cookie is not None
    client.set_cookie("drivetwin-8051", second_cookie.value, domain="127.0.0.1")
    second.set_cookie("drivetwin-8050", first_cookie.value, domain="127.0.0.1")
    assert client.get("/", base_url=HERE).status_code == 200
    assert second.get("/", base_url=there).status_code == 200
    second.set_cookie("drivetwin-8051", first_cookie.value, domain="127.0.0.1")
    assert second.get("/", base_url=there).status_code == 403


@pytest.mark.parametrize("site", ["same-site", "cross-site"])
def test_a_page_of_another_port_loads_nothing(client: FlaskClient, site: str) -> None:
    enter(client, "right")
    headers = {"Sec-Fetch-Site": site, "Sec-Fetch-Mode": "no-cors"}
    assert client.get("/_dash-layout", base_url=HERE, headers=headers).status_code == 403


def test_the_token_is_new_each_time_and_in_no_log() -> None:
    one, other = Access(), Access()
    assert one.token != other.token
    assert len(one.token) >= 43
    assert one.token not in repr(one)
    assert one.make_link(8050) == f"{HERE}/?token={one.token}"
