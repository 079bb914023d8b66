# SPDX-License-Identifier: MIT
"""Form for the numbers of the open vehicle card."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Literal

from dash import ALL, Input, Output, State, html
from dash.development.base_component import Component
from pydantic import BaseModel

from drivetwin.authoring.card_edit import Path, format_path, list_numbers
from drivetwin.workbench.session import Session
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.card_form import build_writing, collect_texts, open_written


class EntryId(BaseModel, strict=True):
    """Id of a field: the place of its entry as a JSON list."""

    entry: str


def layout() -> list[Component]:
    """Build the place of the form, which is filled when a card is open."""
    return [html.Div(id="edit-content")]


def register(page: ui.Page) -> None:
    """Register the form and the writing of the card."""

    @page.callback(Output("edit-content", "children"), Input(ui.make_due_id("card"), "data"))
    def show(session: Session, _: object) -> list[Component]:
        """Draw the numbers of the open card."""
        work = session.work
        if work.opened is None or work.opened.card is None or work.card is None:
            return []
        return _build_form(work.card.path.name, list_numbers(session.read_card_text()))

    @page.callback(
        Input("write-edited", "n_clicks"),
        State("name-edited", "value"),
        State("replace-edited", "data-value"),
        State({"entry": ALL}, "value"),
        State({"entry": ALL}, "id"),
        busy="write-edited",
    )
    def write(
        session: Session,
        clicks: int | None,
        name: str | None,
        existing: Literal["keep", "replace"],
        values: Sequence[str | None],
        ids: Sequence[EntryId],
    ) -> None:
        """Write the card with the typed numbers and open it."""
        if not clicks:
            return
        typed = collect_texts(values, [one.entry for one in ids])
        open_written(
            session,
            session.write_edited_card(name or "", typed, can_replace=existing == "replace"),
        )


def _build_form(name: str, numbers: dict[Path, str]) -> list[Component]:
    fields = [
        ui.make_field(
            {"entry": json.dumps(path)}, format_path(path), type="text", value=text, debounce=True
        )
        for path, text in numbers.items()
    ]
    form = [
        html.Summary("Edit the numbers of the open card"),
        ui.make_hint(
            "Keys and units are those of the file. A number is VALUE, VALUE+-STD with one standard "
            "deviation, or LOW..HIGH. Comments and all other entries stay."
        ),
        html.Div(fields, className="entries"),
        build_writing("edited", "Name of the edited card", name, "Write and open the edited card"),
    ]
    return [html.Details(form, id="edit-form")]
