# SPDX-License-Identifier: MIT
"""The application of the workbench, and the server that its uploads and pages go through."""

from __future__ import annotations

import json
import logging
import socket
import sys
from pathlib import Path

from dash import Dash
from dash.exceptions import DependencyException
from flask import Response, request
from werkzeug.serving import ThreadedWSGIServer, WSGIRequestHandler

from drivetwin.errors import InputError, RefusedError
from drivetwin.workbench import jobs
from drivetwin.workbench.access_control import ADDRESS, Access, make_refusal, protect
from drivetwin.workbench.session import Sessions
from drivetwin.workbench.views.fields import check_callback_requests, escape_callback_responses
from drivetwin.workbench.views.page import Start, build_page
from drivetwin.workbench.workspace import LIMITS, Folder

SESSION_HEADER = "X-Drivetwin-Session"


class _Handler(WSGIRequestHandler):
    """Handler of one connection, which has one request."""

    protocol_version = "HTTP/1.1"
    timeout = 10.0  # s without a byte from the browser, which sends without pauses


def build_server(folder: Folder, start: Start, access: Access) -> tuple[Dash, Sessions]:
    """Build the application and its sessions, to be served under the rules of `access`."""
    sessions = Sessions(folder)
    app = Dash(
        "drivetwin",
        title="drivetwin workbench",
        update_title="",
        assets_folder=str(Path(__file__).parent / "assets"),
        serve_locally=True,
        suppress_callback_exceptions=True,
        add_log_handler=False,
    )
    build_page(app, sessions, start)
    _register_uploads(app, sessions)
    protect(app.server, access, list(app.csp_hashes()))
    check_callback_requests(app.server, app)
    escape_callback_responses(app.server)

    @app.server.errorhandler(DependencyException)  # type: ignore[untyped-decorator]
    def refuse_library(_: DependencyException) -> Response:
        return make_refusal(404, "there is no such file of a library")

    return app, sessions


def start_server(app: Dash, port: int) -> ThreadedWSGIServer:
    """A server on `port` (0: any free one) of this machine, not yet serving.

    Raises InputError where it cannot listen there.
    """
    logging.getLogger("werkzeug").setLevel(logging.ERROR)
    try:
        bound = socket.create_server((ADDRESS, port))
    except (OSError, OverflowError) as fault:
        raise InputError(
            f"cannot listen on port {port}: {fault}", "choose another --port, or 0 for any free one"
        ) from None
    jobs.warm_up()
    with bound:
        return ThreadedWSGIServer(ADDRESS, port, app.server, _Handler, fd=bound.fileno())


def _register_uploads(app: Dash, sessions: Sessions) -> None:
    @app.server.post("/upload/<purpose>")  # type: ignore[untyped-decorator]
    def upload(purpose: str) -> Response:
        limit = LIMITS.get(purpose)
        if limit is None:
            return make_refusal(404, "there is no such upload")
        request.max_content_length = sys.maxsize  # counted while it is received
        name = request.args.get("name", "")
        try:
            session = sessions.get(request.headers.get(SESSION_HEADER))
            key = session.store_upload(request.stream, name, request.content_length, limit)
        except RefusedError as error:
            return make_refusal(400, str(error))
        return Response(json.dumps({"key": key, "name": name}), mimetype="application/json")
