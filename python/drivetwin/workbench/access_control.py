# SPDX-License-Identifier: MIT
"""Access control: the server answers only its own address, and only holders of its link.

A page of another site can make a browser send requests here, under a name that it has made point to
this machine (DNS rebinding). Such a request carries that name as its host and is refused.

Other users of the machine can reach the port. The link that the program prints contains a random
token. A browser that opens it gets two further secrets in exchange: one in a
cookie, one (the key) in the fragment of an address, which the page moves into the storage of its
origin. Browsers send the cookies of a host to all its ports, so that a program of another user on
another port can receive the cookie. The storage belongs to one port. Therefore the cookie alone
opens the empty page; every request that reads or changes data needs the key as well.
"""

from __future__ import annotations

import hmac
import ipaddress
import json
import secrets
from dataclasses import dataclass, field
from urllib.parse import urlsplit

from flask import Flask, Response, request
from werkzeug.exceptions import HTTPException

MAX_REQUEST = 4 * 2**20
"""Bytes of a request that is no upload."""
ADDRESS = "127.0.0.1"
"""Address that the server listens on: this machine alone."""
KEY_HEADER = "X-Drivetwin-Key"
_COOKIE = "drivetwin-{port}"
"""Name of the cookie by the port that the browser asked: two workbenches have two cookies."""
_TOKEN_FIELD = "token"
_ENTRANCE = """<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>drivetwin</title>
<meta http-equiv="refresh" content="0; url=/#key={0}"></head><body><a href="/#key={0}">workbench</a>
</body></html>
"""
"""Page that leads on from the link.

A redirect would be part of a navigation from elsewhere, to which browsers add no SameSite=Strict
cookie.
"""


def _make_secret() -> str:
    return secrets.token_urlsafe(32)


@dataclass(frozen=True)
class Access:
    """Secrets of one run: the `token` of the link, and the `cookie` and `key` given for it."""

    token: str = field(default_factory=_make_secret, repr=False)
    cookie: str = field(default_factory=_make_secret, repr=False)
    key: str = field(default_factory=_make_secret, repr=False)

    def make_link(self, port: int) -> str:
        """Return the link that opens the workbench."""
        return f"http://{ADDRESS}:{port}/?{_TOKEN_FIELD}={self.token}"


def _is_equal(given: str | None, secret: str) -> bool:
    """Return True for the secret, in a time that does not depend on `given`."""
    return hmac.compare_digest((given or "").encode(errors="replace"), secret.encode())


def protect(server: Flask, access: Access, script_hashes: list[str]) -> None:
    """Refuse strangers, bound requests, and let pages load nothing from outside.

    Strangers are foreign hosts and origins, and requests without cookie and key.
    """
    server.config["MAX_CONTENT_LENGTH"] = MAX_REQUEST
    policy = _build_policy(script_hashes)

    @server.before_request
    def refuse_strangers() -> Response | None:
        if not is_own_host(request.host):
            return make_refusal(421, f"this server does not answer to the name {request.host!r}")
        if _is_cross_site():
            return make_refusal(403, "this request comes from another site")
        return _admit(access)

    @server.after_request
    def close_in(response: Response) -> Response:
        response.headers.update(policy)
        return response

    @server.errorhandler(HTTPException)
    def render_refusal(error: HTTPException) -> Response:
        too_large = f"a request may have {MAX_REQUEST / 2**20:.0f} MB"
        return make_refusal(error.code or 500, too_large if error.code == 413 else error.name)


def _is_cross_site() -> bool:
    """Return True if a page of another site or port made the request.

    Links to the page may be anywhere. To browsers another port of the same host is the same site.
    """
    origin = request.headers.get("Origin")
    if origin is not None:
        try:
            return urlsplit(origin).netloc != request.host
        except ValueError:
            return True
    if request.method == "GET" and request.headers.get("Sec-Fetch-Mode") == "navigate":
        return False
    return request.headers.get("Sec-Fetch-Site") in ("cross-site", "same-site")


def _admit(access: Access) -> Response | None:
    """Return None for a browser with the secrets, the page with them for the link, else a refusal.

    GET and HEAD serve the files of the page only, for which the cookie is enough.
    """
    name = _COOKIE.format(port=(urlsplit(f"//{request.host}").port or 80))
    if request.path == "/" and _is_equal(request.args.get(_TOKEN_FIELD), access.token):
        response = Response(_ENTRANCE.format(access.key), mimetype="text/html")
        response.headers["Cache-Control"] = "no-store"
        response.set_cookie(name, access.cookie, httponly=True, samesite="Strict")
        return response
    reads = request.method in ("GET", "HEAD")
    has_key = reads or _is_equal(request.headers.get(KEY_HEADER), access.key)
    if has_key and _is_equal(request.cookies.get(name), access.cookie):
        return None
    return make_refusal(
        403, "no access without the link -> open the link that 'drivetwin app' printed when started"
    )


def is_own_host(named: str) -> bool:
    """Return True for `localhost` and the addresses of this machine, which cannot be rebound."""
    try:
        parts = urlsplit(f"//{named}")
        name, _ = parts.hostname or "", parts.port  # a port that is no number raises ValueError
        return name == "localhost" or ipaddress.ip_address(name).is_loopback
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
