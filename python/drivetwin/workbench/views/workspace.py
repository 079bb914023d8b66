# SPDX-License-Identifier: MIT
"""Workspace: save the session as a file and reopen it later."""

from __future__ import annotations

from dash import Dash, Input, Output, State, dcc, html
from dash.development.base_component import Component

from drivetwin.workbench.session import Sessions
from drivetwin.workbench.views.widgets import (
    Topic,
    acted,
    announce,
    button,
    due_id,
    field,
    hint,
    row,
    tell,
    told,
    upload_button,
)
from drivetwin.workbench.workspace import ENDING


def layout() -> list[Component]:
    """Save and reopen."""
    return [
        hint(
            "A workspace holds the paths of log and card with their check sums, the mapping, "
            "phases, locks, the identified twins and the sliders; not the log itself. "
            "It is a JSON file in the folder of the workbench."
        ),
        html.H3("Save"),
        row(
            html.Div(field("save-name", "Name", type="text", value=f"work{ENDING}"),
                     className="wide"),
            button("Save", "save", main=True),
        ),
        html.H3("Reopen"),
        row(
            html.Div(field("reopen-name", "Workspace", type="text", list="workspace-names"),
                     className="wide"),
            button("Reopen", "reopen", main=True),
            upload_button("Upload a workspace…", "workspace", "workspace-upload"),
        ),
        html.Datalist(id="workspace-names"),
        dcc.Store(id="workspace-upload"),
    ]  # fmt: skip


def register(app: Dash, sessions: Sessions) -> None:
    """Saving and reopening."""

    @app.callback(
        Output("workspace-names", "children"),
        Input("save", "n_clicks"),
        State("session", "data"),
        State("save-name", "value"),
        prevent_initial_call=True,
    )
    @told
    def save(_: int, key: str, name: str | None) -> list[Component]:
        """Write the file."""
        session = sessions.get(key)
        tell(f"saved as {session.save(name or '')}")
        return _names(sessions, key)

    @app.callback(
        Output("workspace-names", "children", allow_duplicate=True),
        Input(due_id("workspace"), "data"),
        State("session", "data"),
        prevent_initial_call=True,
    )
    @told
    def offer(_: int, key: str) -> list[Component]:
        """Workspaces of the folder, for completion."""
        return _names(sessions, key)

    @app.callback(
        Input("reopen", "n_clicks"),
        State("session", "data"),
        State("reopen-name", "value"),
        running=[(Output("reopen", "disabled"), True, False)],
        prevent_initial_call=True,
    )
    @acted
    def reopen(_: int, key: str, name: str | None) -> None:
        """Go on with a file of the folder."""
        session = sessions.get(key)
        session.reopen(session.in_folder(name or ""))
        announce(Topic.LOG)
        tell(f"{name} is reopened")

    @app.callback(
        Input("workspace-upload", "data"), State("session", "data"), prevent_initial_call=True
    )
    @acted
    def reopen_upload(upload: dict[str, str], key: str) -> None:
        """Go on with an upload."""
        session = sessions.get(key)
        session.reopen(session.uploaded(upload["key"]))
        announce(Topic.LOG)
        tell(f"{upload['name']} is reopened")


def _names(sessions: Sessions, key: str) -> list[Component]:
    return [html.Option(value=name) for name in sessions.get(key).folder.names((ENDING,))]
