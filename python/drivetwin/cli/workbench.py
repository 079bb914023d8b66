# SPDX-License-Identifier: MIT
"""`drivetwin app [LOG]`: the workbench in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import typer

from drivetwin._util.atomic import ignore_interrupts
from drivetwin._util.optional_dependencies import import_extra
from drivetwin.cli.output import print_line
from drivetwin.cli.requests.desk import OpenWorkbench
from drivetwin.report.blocks import Outcome

if TYPE_CHECKING:
    from werkzeug.serving import BaseWSGIServer

    from drivetwin.workbench.access_control import Access
    from drivetwin.workbench.views.page import Start
    from drivetwin.workbench.workspace import Folder

_LINK_PAGE = """<!DOCTYPE html><html lang="en"><head><meta charset="utf-8"><title>drivetwin</title>
<meta http-equiv="refresh" content="0; url={0}"></head><body><a href="{0}">{0}</a></body></html>
"""


def workbench(request: OpenWorkbench) -> Outcome:
    """Start the server, open the browser, and serve until the program is ended."""
    import_extra("dash", "app", "the workbench", request.folder)
    from drivetwin.workbench.access_control import Access
    from drivetwin.workbench.jobs import end_all
    from drivetwin.workbench.server import build_server, start_server
    from drivetwin.workbench.workspace import Folder

    place, access = Folder.from_path(request.folder), Access()
    app, sessions = build_server(place, _make_start(place, request), access)
    try:
        server = start_server(app, request.port)
        _serve(server, access, place, sessions.place, browser=request.browser)
    except KeyboardInterrupt:
        pass  # the way to end the program
    finally:
        with ignore_interrupts():
            end_all()
            sessions.close()
    return Outcome()


def _serve(
    server: BaseWSGIServer, access: Access, place: Folder, private: Path, *, browser: bool
) -> None:
    """Print the link and answer requests until the program is ended."""
    link = access.make_link(server.port)
    print_line(f"workbench at {link} , files of {place.root}; Ctrl-C ends it")
    print_line("access: this machine only, with the link")
    with server:
        if browser:
            _launch_browser(link, private)
        server.serve_forever()


def _launch_browser(link: str, private: Path) -> None:
    """Open the link by a page in a private folder.

    Other users can read the arguments of a command, so that the link is none.
    """
    page = private / "workbench.html"
    page.write_text(_LINK_PAGE.format(link), encoding="utf-8")
    typer.launch(page.as_uri())


def _make_start(place: Folder, request: OpenWorkbench) -> Start:
    """The files of the command line, as far as the folder holds them. Raises RefusedError."""
    from drivetwin.workbench.session_state import Source
    from drivetwin.workbench.views.page import Start

    def source(path: Path | None) -> Source | None:
        if path is None:
            return None
        found = place.get_file(str(path.resolve()))
        return Source(place.get_name(found), found)

    return Start(source(request.log), source(request.vehicle), request.channels)
