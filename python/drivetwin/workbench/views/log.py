# SPDX-License-Identifier: MIT
"""Log: open a recording, an upload or the sample; the choice of logs and files in all views."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum
from typing import Any

from dash import ALL, Input, Output, State, dcc, html, no_update
from dash.development.base_component import Component

from drivetwin.findings import render
from drivetwin.logs.formats.detect import SUFFIXES
from drivetwin.report.blocks import make_table
from drivetwin.workbench.sandboxed_parse import Opened
from drivetwin.workbench.session import Session
from drivetwin.workbench.session_state import SessionState, Source
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.fields import Index, UploadField, get_triggered_part
from drivetwin.workbench.views.widgets import render_table, replace_options

_UPLOADED = "uploaded: "
_LISTED = 30
"""Files of the folder with a button; all others are offered while a name is typed."""


def get_source(session: Session, typed: str | None, upload: UploadField | None) -> Source:
    """Return the file that a field names. Raises RefusedError where there is none."""
    if upload is not None and typed == _UPLOADED + upload.name:
        return session.get_uploaded(upload.key)
    return session.get_folder_source(typed or "")


def format_source(source: Source) -> str:
    """Return the text of a field for a file."""
    return _UPLOADED + source.name if source.uploaded else source.name


def build_file_buttons(key: str, kind: str, names: list[str]) -> list[Component]:
    """Build a button for each file of a `kind` in the folder; its id has the name below `key`."""
    if not names:
        return [ui.make_hint(f"The folder of the workbench has no {kind}.")]
    buttons = [html.Button(name, id={key: name}, type="button") for name in names[:_LISTED]]
    more = len(names) - len(buttons)
    hint = [ui.make_hint(f"{more} more: type the name.")] if more > 0 else []
    title = f"{kind[0].upper()}{kind[1:]}s of the folder"
    return [html.H3(title), html.Div(buttons, className="row files"), *hint]


def register_opening(
    page: ui.Page, kind: str, files: str, open_source: Callable[[Session, Source], None]
) -> None:
    """Register the ways to open a file: its upload, its path, a button of the folder's files.

    Parameters
    ----------
    page
        Page of the workbench.
    kind
        Beginning of the ids of the fields for path and upload.
    files
        Key of the buttons, see `build_file_buttons`.
    open_source
        Function that opens the file.
    """
    path, upload_field, button = f"{kind}-path", f"{kind}-upload", f"open-{kind}"

    @page.callback(Output(path, "value", allow_duplicate=True), Input(upload_field, "data"))
    def open_upload(session: Session, upload: UploadField) -> str:
        """Open an upload at once."""
        source = session.get_uploaded(upload.key)
        open_source(session, source)
        return format_source(source)

    @page.callback(
        Input(button, "n_clicks"), State(path, "value"), State(upload_field, "data"), busy=button
    )
    def open_path(
        session: Session, _: object, typed: str | None, upload: UploadField | None
    ) -> None:
        """Open the file of the field."""
        open_source(session, get_source(session, typed, upload))

    @page.callback(Input({files: ALL}, "n_clicks"))
    def open_file(session: Session, clicks: list[int | None]) -> None:
        """Open a listed file of the folder."""
        if any(clicks):
            open_source(session, session.get_folder_source(get_triggered_part(files)))


class Place(StrEnum):
    """Views with the choice."""

    CHANNELS = "channels"
    SHIFTS = "shifts"
    MODEL = "model"


def build_log_choice(work: SessionState, place: Place) -> list[Component]:
    """Build the choice; nothing for a single log."""
    if len(work.logs) < 2:
        return []
    names = {str(k): one.source.name for k, one in enumerate(work.logs)}
    return [ui.make_choice(f"{place}-log", "Log shown", names, str(work.at))]


def register_log_choice(page: ui.Page, place: Place) -> None:
    """Register the choice of one view; all views then show the chosen log."""

    @page.callback(Input(f"{place}-log", "data-value"))
    def choose(session: Session, index: Index | None) -> None:
        """Show another log."""
        if index is not None and int(index) != session.work.at:
            session.update(lambda work: work.select_log(int(index)))
            ui.notify_topic(ui.Topic.SELECTION)


def layout() -> list[Component]:
    """Build the ways to a log, and the facts about the open one."""
    return [
        ui.make_hint(
            "Open a recording with at least one gear shift. Paths are inside the folder of the "
            "workbench. Add log opens a further recording of the same vehicle: one model is "
            "identified from all."
        ),
        ui.make_row(
            html.Div(
                ui.make_field("log-path", "Log", type="text", list="log-names"), className="wide"
            ),
            ui.make_button("Open log", "open-log", main=True),
            ui.make_button("Add log", "add-log"),
            ui.make_upload_button("Upload a log…", "log", "log-upload"),
            ui.make_button("Open the sample", "open-sample"),
        ),
        html.Datalist(id="log-names"),
        dcc.Store(id="log-upload"),
        html.Div(id="log-files"),
        html.Div(id="log-content"),
    ]


def register(page: ui.Page) -> None:
    """Register opening, and the facts about the open log."""
    _register_opening(page)

    @page.callback(
        Output("log-content", "children"),
        Output("log-path", "value"),
        Output("log-names", "children"),
        Output("log-files", "children"),
        Input(ui.make_due_id("log"), "data"),
    )
    def show(session: Session, _: str) -> tuple[Any, ...]:
        """Render the open log and the files of the folder."""
        work = session.work
        content = [] if work.opened is None else [*_list_logs(work), *_build_content(work.opened)]
        names = session.folder.list_names(SUFFIXES)
        options = [html.Option(value=name) for name in names]
        # Without an open log the field keeps the text that was typed while the page loaded.
        path = no_update if work.log is None else format_source(work.log)
        return content, path, options, build_file_buttons("file", "log", names)


def _register_opening(page: ui.Page) -> None:
    register_opening(page, "log", "file", _open)

    @page.callback(
        Input("add-log", "n_clicks"),
        State("log-path", "value"),
        State("log-upload", "data"),
        busy="add-log",
    )
    def add_path(session: Session, _: object, log: str | None, upload: UploadField | None) -> None:
        """Open the log of the field beside the others."""
        if not session.work.logs:
            _open(session, get_source(session, log, upload))
            return
        source = get_source(session, log, upload)
        session.add_log(source)
        ui.notify_topic(ui.Topic.LOG)
        ui.notify_opened_log(f"{source.name} is added", session.work.logs[-1])

    @page.callback(Input({"remove": ALL}, "n_clicks"))
    def remove(session: Session, clicks: list[int | None]) -> None:
        """Close one of several logs."""
        if any(clicks):
            index = get_triggered_part("remove")
            session.cancel()
            session.update(lambda work: work.remove_log(int(index) if index.isdecimal() else -1))
            ui.notify_topic(ui.Topic.LOG)
            ui.notify("The log is removed")

    @page.callback(Input("open-sample", "n_clicks"), busy="open-sample")
    def open_sample(session: Session, _: object) -> None:
        """Open the sample with its card."""
        session.open_sample()
        ui.notify_topic(ui.Topic.LOG)
        ui.notify_opened_log("The sample is open with its card", session.work.logs[0])


def _open(session: Session, source: Source) -> None:
    session.open_log(source)
    ui.notify_topic(ui.Topic.LOG)
    ui.notify_opened_log(f"{source.name} is open", session.work.logs[0])


def _list_logs(work: SessionState) -> list[Component]:
    """List the logs where several are open."""
    if len(work.logs) < 2:
        return []
    rows = [
        (
            one.source.name,
            "cannot be read" if one.opened.log is None else str(len(one.opened.log.channels)),
            str(len(one.shifts)) if one.opened.ratios is None else "–",
        )
        for one in work.logs
    ]
    buttons = [
        [
            html.Button(
                ["Remove", html.Span(f" {one.source.name}", className="unseen")],
                id={"remove": str(k)},
                type="button",
            )
        ]
        for k, one in enumerate(work.logs)
    ]
    table = make_table("Open logs, identified together", ("log", "channels", "shifts"), rows)
    return [
        render_table(table, [""], buttons),
        html.H3(f"About {work.logs[work.at].source.name}"),
    ]


def _build_content(opened: Opened) -> list[Component]:
    if opened.log is None:
        return [ui.make_notes("The log cannot be read as mapped", [replace_options(opened.fault)])]
    log = opened.log
    first = min(float(one.time[0]) for one in log.channels.values())
    last = max(float(one.time[-1]) for one in log.channels.values())
    facts = {
        "columns": str(len(opened.survey.columns)),
        "channels mapped": str(len(log.channels)),
        "from": f"{first:z.3f} s",
        "to": f"{last:z.3f} s",
    }
    remarks = map(replace_options, render(log.findings))
    return [build_facts_line(facts), ui.make_notes("About the log", remarks)]


def build_facts_line(facts: dict[str, str]) -> Component:
    """Build figures side by side, each under its name."""
    return html.Div(
        [html.Div([html.Span(name), html.Strong(value)]) for name, value in facts.items()],
        className="facts",
    )
