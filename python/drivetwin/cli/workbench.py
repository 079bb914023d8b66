# SPDX-License-Identifier: MIT
"""`drivetwin app [LOG]`: the workbench in the browser."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drivetwin.cli.output import print_line, print_paragraph
from drivetwin.errors import MissingExtraError

if TYPE_CHECKING:
    from drivetwin.workbench.views.page import Start
    from drivetwin.workbench.workspace_folder import Folder

LOOPBACK = "127.0.0.1"


def workbench(
    log: Annotated[
        Path | None, typer.Argument(metavar="[LOG]", help="Log to open, inside the folder.")
    ] = None,
    vehicle: Annotated[
        Path | None, typer.Option("--vehicle", metavar="CARD", help="Vehicle card (TOML).")
    ] = None,
    channels: Annotated[
        Path | None, typer.Option("--channels", metavar="MAP", help="Channel mapping file (TOML).")
    ] = None,
    folder: Annotated[
        Path, typer.Option("--folder", metavar="DIR", help="Files are opened and saved in here.")
    ] = Path(),
    host: Annotated[
        str, typer.Option("--host", help="Address to listen on; this machine alone by default.")
    ] = LOOPBACK,
    port: Annotated[int, typer.Option("--port", help="Port; 0: any free one.")] = 8050,
    browser: Annotated[
        bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")
    ] = True,
) -> None:
    """Open the workbench: from a log to a checked model, in the browser.

    Works without a network. Other machines reach it only with --host.
    """
    _require_dash()
    from drivetwin.workbench.access_control import is_loopback
    from drivetwin.workbench.server import build_server, start_server
    from drivetwin.workbench.workspace_folder import Folder

    place = Folder.from_path(folder)
    app, sessions = build_server(place, _make_start(place, log, vehicle, channels), host)
    server = start_server(app, host, port)
    shown = f"[{host}]" if ":" in host else host
    address = f"http://{shown}:{server.port}/"
    print_line(f"workbench at {address}, files of {place.root}; Ctrl-C ends it")
    if not is_loopback(host):
        print_paragraph(
            "warning: every machine that reaches this address can read and write files of this "
            "folder; there is no password"
        )
    if browser:
        typer.launch(address)
    signal.signal(signal.SIGTERM, _stop_on_signal)
    try:
        server.serve_forever()
    finally:
        server.server_close()
        sessions.close()


def _stop_on_signal(*_: object) -> None:
    """End as after Ctrl-C: jobs stopped, temporary files removed."""
    raise SystemExit(0)


def _require_dash() -> None:
    try:
        import dash  # noqa: F401
    except ImportError:
        raise MissingExtraError(
            "the workbench needs the library dash", 'pip install "drivetwin[app]"'
        ) from None


def _make_start(place: Folder, log: Path | None, card: Path | None, mapping: Path | None) -> Start:
    """The files of the command line, as far as the folder holds them. Raises RefusedError."""
    from drivetwin.workbench.session_state import Source
    from drivetwin.workbench.views.page import Start

    def source(path: Path | None) -> Source | None:
        if path is None:
            return None
        found = place.get_file(str(path.resolve()))
        return Source(place.get_name(found), found)

    return Start(source(log), source(card), mapping)
