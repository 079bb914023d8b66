# SPDX-License-Identifier: MIT
"""Log: open a recording and its vehicle card; what was found in it."""

from __future__ import annotations

from typing import Any

from dash import Input, Output, State, dcc, html
from dash.development.base_component import Component

from drivetwin.findings import render
from drivetwin.logs.formats.detect import SUFFIXES
from drivetwin.workbench.sandboxed_parse import Opened
from drivetwin.workbench.session import Session
from drivetwin.workbench.session_state import Source
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.fields import UploadField

_CARDS = (".toml",)
_UPLOADED = "uploaded: "
_SHIFT_HEAD = ("shift", "kind", "elements", "starts", "locks")


def layout() -> list[Component]:
    """Two files, by path or upload, and what they hold."""
    return [
        ui.make_hint(
            "A recording with at least one gear shift, and the vehicle card that says what is "
            "known from design. Paths are inside the folder that the workbench was started in."
        ),
        ui.make_row(
            html.Div(
                ui.make_field("log-path", "Log", type="text", list="log-names"), className="wide"
            ),
            ui.make_upload_button("Upload a log…", "log", "log-upload"),
        ),
        ui.make_row(
            html.Div(
                ui.make_field("card-path", "Vehicle card", type="text", list="card-names"),
                className="wide",
            ),
            ui.make_upload_button("Upload a card…", "card", "card-upload"),
        ),
        ui.make_row(ui.make_button("Open", "open", main=True)),
        html.Datalist(id="log-names"),
        html.Datalist(id="card-names"),
        dcc.Store(id="log-upload"),
        dcc.Store(id="card-upload"),
        html.Div(id="log-content"),
    ]


def register(page: ui.Page) -> None:
    """Opening, and what is shown of it."""

    for name in ("log", "card"):

        @page.callback(
            Output(f"{name}-path", "value", allow_duplicate=True), Input(f"{name}-upload", "data")
        )
        def arrived(session: Session, upload: UploadField) -> str:  # noqa: ARG001
            """Put the name of an upload into the path field."""
            return _UPLOADED + upload.name

    @page.callback(
        Input("open", "n_clicks"),
        State("log-path", "value"),
        State("card-path", "value"),
        State("log-upload", "data"),
        State("card-upload", "data"),
        busy="open",
    )
    def open_files(
        session: Session,
        _: object,
        log: str | None,
        card: str | None,
        log_up: UploadField | None,
        card_up: UploadField | None,
    ) -> None:
        """Read log and card."""
        session.open(_get_source(session, log, log_up), _get_source(session, card, card_up))
        opened = session.work.require_opened()
        ui.notify_topic(ui.Topic.LOG)
        ui.notify_opened_log(f"{log} is open", opened.fault, len(session.work.shifts))

    @page.callback(
        Output("log-content", "children"),
        Output("log-path", "value"),
        Output("card-path", "value"),
        Output("log-names", "children"),
        Output("card-names", "children"),
        Input(ui.make_due_id("log"), "data"),
    )
    def show(session: Session, _: str) -> tuple[Any, ...]:
        """Render the open log."""
        work, folder = session.work, session.folder
        content = [] if work.opened is None else _build_content(work.opened)
        names = [
            [html.Option(value=name) for name in folder.list_names(ends)]
            for ends in (SUFFIXES, _CARDS)
        ]
        return content, _format_source(work.log), _format_source(work.card), *names


def _get_source(session: Session, typed: str | None, upload: UploadField | None) -> Source:
    """The file that a field names: an upload, or a path in the folder."""
    if upload is not None and typed == _UPLOADED + upload.name:
        return session.get_uploaded(upload.key)
    return session.get_folder_source(typed or "")


def _format_source(source: Source | None) -> str:
    if source is None:
        return ""
    return _UPLOADED + source.name if source.uploaded else source.name


def _build_content(opened: Opened) -> list[Component]:
    if opened.log is None or opened.found is None:
        return [
            ui.make_notes("The log cannot be read as mapped", [opened.fault]),
            ui.make_hint("Correct the mapping under Channels."),
        ]
    log, found = opened.log, opened.found
    first = min(float(one.time[0]) for one in log.channels.values())
    last = max(float(one.time[-1]) for one in log.channels.values())
    facts = {
        "columns": str(len(opened.survey.columns)),
        "channels used": str(len(log.channels)),
        "from": f"{first:.3f} s",
        "to": f"{last:.3f} s",
        "usable shifts": str(len(found.shifts)),
    }
    shifts = [
        (
            f"{one.start_gear}→{one.end_gear}",
            one.kind.value,
            f"{one.offgoing} → {one.oncoming}",
            f"{one.torque_phase[0]:.3f} s",
            f"{one.lockup_time:.3f} s",
        )
        for one in found.shifts
    ]
    refused = [f"{r.time[0]:.2f} s to {r.time[1]:.2f} s: {r.reason}" for r in found.rejected]
    return [
        build_facts_line(facts),
        *([ui.make_table(_SHIFT_HEAD, shifts, "Shifts of the log")] if shifts else []),
        ui.make_notes("About the log", render(log.findings)),
        ui.make_notes(
            "Not used" if shifts else "No usable shift", refused, "plain" if shifts else "doubtful"
        ),
    ]


def build_facts_line(facts: dict[str, str]) -> Component:
    """Figures side by side, each under its name."""
    return html.Div(
        [html.Div([html.Span(name), html.Strong(value)]) for name, value in facts.items()],
        className="facts",
    )
