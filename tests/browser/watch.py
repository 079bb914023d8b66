# SPDX-License-Identifier: MIT
"""What no page may do: ask the outside, log an error, or lock out people with a disability."""

from __future__ import annotations

from typing import Any
from urllib.parse import urlsplit

from axe_core_python.sync_playwright import Axe
from playwright.sync_api import ConsoleMessage, Error, Page, Request

LOCAL_SCHEMES = frozenset({"file", "data", "blob", "about"})
LOCAL_HOSTS = frozenset({"127.0.0.1", "localhost"})
GRAVE = frozenset({"serious", "critical"})


class Watch:
    """Collects the faults of a page from its creation on."""

    def __init__(self, page: Page) -> None:
        self.faults: list[str] = []
        page.on("request", self._request)
        page.on("console", self._console)
        page.on("pageerror", self._error)

    def _request(self, request: Request) -> None:
        address = urlsplit(request.url)
        if address.scheme not in LOCAL_SCHEMES and address.hostname not in LOCAL_HOSTS:
            self.faults.append(f"request to {request.url}")

    def _console(self, message: ConsoleMessage) -> None:
        if message.type == "error":
            self.faults.append(f"console: {message.text}")

    def _error(self, error: Error) -> None:
        self.faults.append(f"error: {error}")


def grave_findings(page: Page, *rules: str) -> list[str]:
    """Findings of axe-core that are serious or critical, one line each; by some `rules` or all."""
    only = {"runOnly": list(rules)} if rules else {}
    found: dict[str, Any] = Axe().run(page, options={"resultTypes": ["violations"], **only})
    return [
        f"{one['impact']}: {one['id']}, {one['help']}: {one['nodes'][0]['html'][:200]}"
        for one in found["violations"]
        if one["impact"] in GRAVE
    ]
