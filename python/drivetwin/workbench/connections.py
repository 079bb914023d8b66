# SPDX-License-Identifier: MIT
"""HTTP server with limits on the number of connections and on the time for the head of a request.

A connection that sends nothing, or a head byte by byte, holds a thread. Without limits another
program on this machine can use up the threads without the link.
"""

from __future__ import annotations

import socket
import threading
import time
from contextlib import suppress
from typing import Any

from flask import Flask
from werkzeug.serving import ThreadedWSGIServer, WSGIRequestHandler

MOST_CONNECTIONS = 64
"""Connections at a time; a browser opens six to one host, whatever the number of its tabs."""
HEAD_LIMIT = 10.0
"""Time [s] for the head of a request; a browser sends it at once.

Also the time in which a refused request has to end: the rest of its body is read and discarded, so
that the browser gets to the reason.
"""
_REFUSED = 400
"""Lowest HTTP status of a refusal."""
_FULL = b"HTTP/1.1 503 Service Unavailable\r\nConnection: close\r\nContent-Length: 0\r\n\r\n"


class _Handler(WSGIRequestHandler):
    """Handler of one connection, which has one request."""

    protocol_version = "HTTP/1.1"
    server: BoundedServer

    def parse_request(self) -> bool:
        """Read the head; return False if it is wrong or came too late."""
        is_whole = super().parse_request()
        return self.server.mark_busy(self.connection) and is_whole

    def send_response(self, code: int, message: str | None = None) -> None:
        """Begin the answer."""
        if code >= _REFUSED:
            self.server.mark_waiting(self.connection)
        super().send_response(code, message)


class BoundedServer(ThreadedWSGIServer):
    """Server with bounded connections; at the bound the one waiting longest for a head ends."""

    def __init__(self, host: str, port: int, app: Flask, fd: int) -> None:
        super().__init__(host, port, app, _Handler, fd=fd)
        self._waiting: dict[socket.socket, float] = {}
        """Connections without a whole head, with the begin of the wait [s], oldest first."""
        self._busy: set[socket.socket] = set()
        self._guard = threading.Lock()

    def mark_busy(self, connection: socket.socket) -> bool:
        """Note that the head is complete; return False if the connection was ended meanwhile."""
        with self._guard:
            is_in_time = self._waiting.pop(connection, None) is not None
            if is_in_time:
                self._busy.add(connection)
            return is_in_time

    def mark_waiting(self, connection: socket.socket) -> None:
        """Note that the connection has to end within `HEAD_LIMIT`."""
        with self._guard:
            self._busy.discard(connection)
            self._waiting[connection] = time.monotonic()

    def process_request(self, request: Any, client_address: Any) -> None:
        """Serve a new connection in a thread; refuse it if all others are busy."""
        with self._guard:
            is_full = len(self._waiting) + len(self._busy) >= MOST_CONNECTIONS
            if is_full and self._waiting:
                self._end(next(iter(self._waiting)))
                is_full = False
            if not is_full:
                self._waiting[request] = time.monotonic()
        if is_full:
            with suppress(OSError):
                request.sendall(_FULL)
            self.shutdown_request(request)
            return
        super().process_request(request, client_address)

    def service_actions(self) -> None:
        """End connections whose head is overdue; called twice a second."""
        latest = time.monotonic() - HEAD_LIMIT
        with self._guard:
            for one in [one for one, begun in self._waiting.items() if begun < latest]:
                self._end(one)

    def shutdown_request(self, request: Any) -> None:
        """Close a connection and forget it."""
        with self._guard:
            self._waiting.pop(request, None)
            self._busy.discard(request)
        super().shutdown_request(request)

    def _end(self, connection: socket.socket) -> None:
        """End a connection: its thread reads the end of the stream."""
        del self._waiting[connection]
        with suppress(OSError):
            connection.shutdown(socket.SHUT_RDWR)
