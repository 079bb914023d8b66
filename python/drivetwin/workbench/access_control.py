# SPDX-License-Identifier: MIT
"""Access control: the server answers only requests that name its own address.

A page of another site can make a browser send requests here, under a name that it has made point to
this machine (DNS rebinding). Such a request carries that name as its host and is refused.
"""

from __future__ import annotations

import ipaddress
import json
from urllib.parse import urlsplit

from flask import Flask, Response, request
from werkzeug.exceptions import HTTPException

MAX_REQUEST = 4 * 2**20
"""Bytes of a request that is no upload."""
LOCAL = "localhost"


def protect(server: Flask, host: str, script_hashes: list[str]) -> None:
    """Refuse foreign hosts and origins, bound requests, and let pages load nothing from outside.

    `host` is the address that the server listens on; names beside it and `localhost` are refused.
    """
    server.config["MAX_CONTENT_LENGTH"] = MAX_REQUEST
    policy = _build_policy(script_hashes)

    @server.before_request
    def refuse_strangers() -> Response | None:
        if not is_own_host(request.host, host):
            return make_refusal(421, f"this server does not answer to the name {request.host!r}")
        origin = request.headers.get("Origin")
        foreign = origin is not None and urlsplit(origin).netloc != request.host
        if foreign or request.headers.get("Sec-Fetch-Site") == "cross-site":
            return make_refusal(403, "this request comes from another site")
        return None

    @server.after_request
    def close_in(response: Response) -> Response:
        response.headers.update(policy)
        return response

    @server.errorhandler(HTTPException)
    def render_refusal(error: HTTPException) -> Response:
        too_large = f"a request may have {MAX_REQUEST / 2**20:.0f} MB"
        return make_refusal(error.code or 500, too_large if error.code == 413 else error.name)


def is_own_host(named: str, host: str) -> bool:
    """Return True if the host named by a request is this server.

    Addresses cannot be rebound. Of the names, only `localhost` and the listening name are accepted.
    If the server listens on this machine alone, the address must be one of this machine.
    """
    try:
        name = urlsplit(f"//{named}").hostname or ""
    except ValueError:
        return False
    if name in (LOCAL, host.lower()):
        return True
    try:
        address = ipaddress.ip_address(name)
    except ValueError:
        return False
    return address.is_loopback or not is_loopback(host)


def is_loopback(host: str) -> bool:
    """Return True if a listening address can be reached from this machine alone."""
    if host == LOCAL:
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def make_refusal(status: int, text: str) -> Response:
    """Return a response with the reason of the refusal."""
    return Response(json.dumps({"error": text}), status, mimetype="application/json")


def _build_policy(script_hashes: list[str]) -> dict[str, str]:
    scripts = " ".join(["'self'", *script_hashes])
    rules = (
        "default-src 'self'",
        f"script-src {scripts}",
        "style-src 'self' 'unsafe-inline'",  # figures and components set styles on elements
        "img-src 'self' data: blob:",
        "font-src 'self' data:",
        "object-src 'none'",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'none'",
    )
    return {
        "Content-Security-Policy": "; ".join(rules),
        "X-Content-Type-Options": "nosniff",
        "Referrer-Policy": "no-referrer",
        "Cross-Origin-Resource-Policy": "same-origin",
        "Cross-Origin-Opener-Policy": "same-origin",
    }
