# SPDX-License-Identifier: MIT
"""Workspace: save the session as a file and reopen it later."""

from __future__ import annotations

from dash import Input, Output, State, dcc, html
from dash.development.base_component import Component

from drivetwin.workbench.session import Session
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.fields import UploadField
from drivetwin.workbench.workspace import ENDING


def layout() -> list[Component]:
    """Save and reopen."""
    return [
        ui.make_hint(
            "A workspace is a JSON file in the folder of the workbench. It contains the paths of "
            "logs and card with check sums, mappings, phases, locks, twins and sliders, but "
            "not the log."
        ),
        html.H3("Save"),
        ui.make_row(
            html.Div(ui.make_field("save-name", "Name", type="text", value=f"work{ENDING}"),
                     className="wide"),
            ui.make_button("Save", "save", main=True),
        ),
        html.H3("Reopen"),
        ui.make_row(
            html.Div(ui.make_field("reopen-name", "Workspace", type="text", list="workspace-names"),
                     className="wide"),
            ui.make_button("Reopen", "reopen", main=True),
            ui.make_upload_button("Upload a workspace…", "workspace", "workspace-upload"),
        ),
        html.Datalist(id="workspace-names"),
        dcc.Store(id="workspace-upload"),
    ]  # fmt: skip


def register(page: ui.Page) -> None:
    """Saving and reopening."""

    @page.callback(
        Output("workspace-names", "children"),
        Input("save", "n_clicks"),
        State("save-name", "value"),
    )
    def save(session: Session, _: object, name: str | None) -> list[Component]:
        """Write the file."""
        ui.notify(f"saved as {session.save(name or '')}")
        return _build_names(session)

    @page.callback(
        Output("workspace-names", "children", allow_duplicate=True),
        Input(ui.make_due_id("workspace"), "data"),
    )
    def offer(session: Session, _: object) -> list[Component]:
        """Workspaces of the folder, for completion."""
        return _build_names(session)

    @page.callback(Input("reopen", "n_clicks"), State("reopen-name", "value"), busy="reopen")
    def reopen(session: Session, _: object, name: str | None) -> None:
        """Go on with a file of the folder."""
        session.reopen(session.get_folder_source(name or ""))
        ui.notify_topic(ui.Topic.LOG)
        ui.notify(f"{name} is reopened")

    @page.callback(Input("workspace-upload", "data"))
    def reopen_upload(session: Session, upload: UploadField) -> None:
        """Go on with an upload."""
        session.reopen(session.get_uploaded(upload.key))
        ui.notify_topic(ui.Topic.LOG)
        ui.notify(f"{upload.name} is reopened")


def _build_names(session: Session) -> list[Component]:
    return [html.Option(value=name) for name in session.folder.list_names((ENDING,))]
