# SPDX-License-Identifier: MIT
"""Access control: the server answers only its own address, and only holders of its link.

A page of another site can make a browser send requests here, under a name that it has made point to
this machine (DNS rebinding). Such a request carries that name as its host and is refused.

Other users of the machine, and other machines, can reach the port. The link that the program prints
contains a random token. A browser that opens it gets two secrets of its own in exchange: one in a
cookie, one (the key) in the fragment of an address, which the page moves into the storage of its
origin. Browsers send the cookies of a host to all its ports, so that a program of another user on
another port can receive the cookie. The storage belongs to one port. Therefore the cookie alone
opens the empty page; every request that reads or changes data needs the key as well.
"""

from __future__ import annotations

import hashlib
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
LOCAL = "localhost"
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


@dataclass(frozen=True)
class Access:
    """Rules of access to a server.

    `host` is the address that it listens on, `token` the secret that its users have.
    """

    host: str = "127.0.0.1"
    token: str = field(default_factory=lambda: secrets.token_urlsafe(32), repr=False)

    def make_link(self, port: int) -> str:
        """Return the link that opens the workbench."""
        shown = f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{shown}:{port}/?{_TOKEN_FIELD}={self.token}"

    def describe(self) -> str:
        """Describe who may connect, for the status line."""
        if is_loopback(self.host):
            return "access: this machine only, with the link from the terminal"
        return f"access: every machine that reaches {self.host}, with the link from the terminal"

    def is_token(self, given: str | None) -> bool:
        """Return True for the token, in a time that does not depend on `given`."""
        return hmac.compare_digest((given or "").encode(errors="replace"), self.token.encode())


@dataclass(frozen=True)
class _Browsers:
    """Digests of the secrets of the browsers that opened the link.

    A browser that opens the link twice has two pairs for a moment, hence no pairing.
    """

    cookies: set[bytes] = field(default_factory=set)
    keys: set[bytes] = field(default_factory=set)

    def admit(self) -> tuple[str, str]:
        """Return cookie and key of one more browser."""
        cookie, key = secrets.token_urlsafe(32), secrets.token_urlsafe(32)
        self.cookies.add(_digest(cookie))
        self.keys.add(_digest(key))
        return cookie, key


def _digest(secret: str) -> bytes:
    return hashlib.sha256(secret.encode(errors="replace")).digest()


def protect(server: Flask, access: Access, script_hashes: list[str]) -> None:
    """Refuse strangers, bound requests, and let pages load nothing from outside.

    Strangers are foreign hosts and origins, and requests without cookie and key.
    """
    browsers = _Browsers()
    server.config["MAX_CONTENT_LENGTH"] = MAX_REQUEST
    policy = _build_policy(script_hashes)

    @server.before_request
    def refuse_strangers() -> Response | None:
        if not is_own_host(request.host, access.host):
            return make_refusal(421, f"this server does not answer to the name {request.host!r}")
        if _is_cross_site():
            return make_refusal(403, "this request comes from another site")
        return _admit(access, browsers)

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


def _admit(access: Access, browsers: _Browsers) -> Response | None:
    """Return None for a known browser, the page with its secrets for the link, else a refusal.

    GET and HEAD serve the files of the page only, for which the cookie is enough.
    """
    name = _COOKIE.format(port=_get_port(request.host))
    if request.path == "/" and access.is_token(request.args.get(_TOKEN_FIELD)):
        cookie, key = browsers.admit()
        response = Response(_ENTRANCE.format(key), mimetype="text/html")
        response.headers["Cache-Control"] = "no-store"
        response.set_cookie(name, cookie, httponly=True, samesite="Strict")
        return response
    reads = request.method in ("GET", "HEAD")
    has_key = reads or _digest(request.headers.get(KEY_HEADER, "")) in browsers.keys
    if has_key and _digest(request.cookies.get(name, "")) in browsers.cookies:
        return None
    return make_refusal(
        403, "no access without the link -> open the link that 'drivetwin app' printed when started"
    )


def _get_port(host: str) -> int:
    """Return the port of a checked host header."""
    return urlsplit(f"//{host}").port or 80


def is_own_host(named: str, host: str) -> bool:
    """Return True if the host named by a request is this server.

    Addresses cannot be rebound. Of the names, only `localhost` and the listening name are accepted.
    If the server listens on this machine alone, the address must be one of this machine.
    """
    try:
        parts = urlsplit(f"//{named}")
        name, _ = parts.hostname or "", parts.port  # a port that is no number raises ValueError
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
