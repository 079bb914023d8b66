# SPDX-License-Identifier: MIT
"""Who is answered: this machine's own pages, whatever a request calls us."""

from __future__ import annotations

import pytest

from drivetwin.workbench.access_control import is_loopback, is_own_host


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
