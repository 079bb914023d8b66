# SPDX-License-Identifier: MIT
"""Choice of a log, and fields that name a file: a path in the folder, or an upload."""

from __future__ import annotations

from collections.abc import Callable
from enum import StrEnum

from dash import ALL, Input, Output, State, html
from dash.development.base_component import Component

from drivetwin.workbench.session import Session
from drivetwin.workbench.session_state import SessionState, Source
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.fields import Index, UploadField, get_triggered_part

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
            session.select_log(int(index))
            ui.notify_topic(ui.Topic.SELECTION)
