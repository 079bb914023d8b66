# SPDX-License-Identifier: MIT
"""Card: open the vehicle card, edit its text, or answer the questions of a new one."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal

from dash import ALL, Input, Output, State, ctx, dcc, html, no_update
from dash.development.base_component import Component
from pydantic import TypeAdapter, ValidationError

from drivetwin.authoring.question import FormEntry, Key
from drivetwin.errors import RefusedError
from drivetwin.findings import render
from drivetwin.report.inputs import build_card_tables, build_ratio_tables
from drivetwin.vehicle.card_fields import get_card_field
from drivetwin.workbench.forms import CardForm
from drivetwin.workbench.sandboxed_parse import Opened
from drivetwin.workbench.session import CARD_TEXT, Session
from drivetwin.workbench.session_state import Source
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.fields import ControlId
from drivetwin.workbench.views.log import (
    build_file_buttons,
    format_source,
    register_opening,
)
from drivetwin.workbench.views.widgets import render_table, replace_options

_KEY = TypeAdapter(list[str | int])
_EXISTING = {"keep": "keep it", "replace": "replace it"}


def _register_form(page: ui.Page) -> None:
    """Register the begin of a form, and its fields."""
    _register_fields(page)

    @page.callback(Input("begin-card", "n_clicks"), busy="begin-card")
    def begin(session: Session, _: object) -> None:
        """Read the log and show the questions."""
        session.begin_card()
        ui.notify_topic(ui.Topic.FORM)
        ui.notify(
            "Values in grey come from the log or are defaults. Type a better value over them."
        )


def _register_writing(page: ui.Page, part: str, write: Callable[..., Source]) -> None:
    """Register the button that writes a card of the fields of a `part`, and opens it."""
    fields = {"part": part, "id": ALL}

    @page.callback(
        Input(f"write-{part}", "n_clicks"),
        State(f"name-{part}", "value"),
        State(f"replace-{part}", "data-value"),
        State(fields, "value"),
        State(fields, "id"),
        busy=f"write-{part}",
    )
    def write_card(
        session: Session,
        clicks: int | None,
        name: str | None,
        existing: Literal["keep", "replace"],
        values: Sequence[str | None],
        ids: Sequence[ControlId],
    ) -> None:
        """Write the card into the folder and open it."""
        if clicks:
            texts = collect_texts(values, [one.id for one in ids])
            source = write(session, name or "", texts, can_replace=existing == "replace")
            session.open_card(source)
            ui.notify_topic(ui.Topic.LOG)
            text = f"{source.name} is written and open"
            ui.notify_opened_log(text, session.work.require_open_log())


def _register_fields(page: ui.Page) -> None:
    @page.callback(
        Output("form-fields", "children"),
        Output("form-state", "children"),
        Output({"part": "note", "id": ALL}, "children"),
        Output({"part": "question", "id": ALL}, "placeholder"),
        Input({"part": "question", "id": ALL}, "value"),
        State({"part": "question", "id": ALL}, "id"),
    )
    def fill_in(
        session: Session, values: Sequence[str | None], ids: Sequence[ControlId]
    ) -> tuple[object, ...]:
        """Ask what follows from the answers; fields stay as long as the questions do."""
        form = session.form
        changed = [one.get("id") for one in ctx.triggered_prop_ids.values() if one]
        # Only changed fields: others may be older than the texts that the server has.
        rows = [k for k, one in enumerate(ids) if one.id in changed]
        texts = collect_texts([values[k] for k in rows], [ids[k].id for k in rows])
        kept = [no_update] * len(ids)
        if form is None or not texts:
            return no_update, no_update, kept, kept
        form.fill_in(texts)
        state = _describe_state(form)
        if [_name_key(one.question.key) for one in form.entries] != [one.id for one in ids]:
            return _build_fields(form), state, kept, kept
        defaults = [one.question.format_default() for one in form.entries]
        return no_update, state, [_build_notes(one) for one in form.entries], defaults

    @page.callback(Output("form-content", "children"), Input(ui.make_due_id("card"), "data"))
    def show(session: Session, _: object) -> list[Component]:
        """Draw the form."""
        return [] if session.form is None else build_form(session.form)


def collect_texts(values: Sequence[str | None], ids: Sequence[str]) -> dict[Any, str]:
    """Return the texts by the key of the field. Raises RefusedError for an id that is no key."""
    try:
        return {
            tuple(_KEY.validate_json(one, strict=True)): value or ""
            for value, one in zip(values, ids, strict=True)
        }
    except ValidationError:
        raise RefusedError(
            "the request names no field of the card", "load the page again"
        ) from None


def build_form(form: CardForm) -> list[Component]:
    """Build the fields in groups, and below them the name of the file."""
    return [
        html.Div(_build_fields(form), id="form-fields"),
        html.P(_describe_state(form), id="form-state", className="hint"),
        build_writing("question", "File name", form.file_name, "Write and open the card"),
    ]


def build_writing(id: str, label: str, name: str, action: str) -> Component:
    """Build name, choice and button that write a file; their ids end in `id`."""
    return ui.make_row(
        html.Div(ui.make_field(f"name-{id}", label, type="text", value=name), className="wide"),
        ui.make_choice(f"replace-{id}", "If the file exists", _EXISTING, "keep"),
        ui.make_button(action, f"write-{id}", main=True),
    )


def _describe_state(form: CardForm) -> str:
    open_ = sum(bool(one.fault) for one in form.entries)
    if not open_:
        return "The card is complete."
    return f"{open_} of {len(form.entries)} answers are missing or refused."


def _build_fields(form: CardForm) -> list[Component]:
    groups: dict[str, list[Component]] = {}
    for entry in form.entries:
        title = get_card_field(*entry.question.key).group
        groups.setdefault(title, []).append(_build_entry(entry))
    return [
        html.Fieldset([html.Legend(title), *fields], className="questions")
        for title, fields in groups.items()
    ]


def _name_key(key: Key) -> str:
    """Return the id of a question."""
    return json.dumps(list(key))


def _build_notes(entry: FormEntry) -> list[Component]:
    """Build the meaning of a question with the origin of its default, and the fault."""
    question, meaning = entry.question, replace_options(entry.question.meaning)
    if question.default is not None and question.default.note:
        meaning = f"{meaning} {question.format_default()}: {question.default.note}."
    parts: list[Component] = [html.P(meaning, className="hint")]
    if entry.fault:
        parts.append(html.P(replace_options(entry.fault), className="fault"))
    return parts


def _build_entry(entry: FormEntry) -> Component:
    """Build field, explanation, and the reason why the typed answer is refused."""
    question = entry.question
    name = _name_key(question.key)
    unit = f" [{question.unit}]" if question.unit else ""
    choices = f"choices {name}" if question.choices else ""
    parts: list[Component] = [
        ui.make_field(
            {"part": "question", "id": name},
            f"{question.prompt}{unit}",
            type="text",
            value=entry.text,
            debounce=True,
            placeholder=question.format_default(),
            list=choices,
        ),
        html.Div(_build_notes(entry), id={"part": "note", "id": name}),
    ]
    if question.choices:
        options = [html.Option(value=str(one)) for one in question.choices]
        parts.append(html.Datalist(options, id=choices))
    return html.Div(parts, className="question")


def _register_edit(page: ui.Page) -> None:
    """Register the form for the text of the open card."""

    @page.callback(Output("edit-content", "children"), Input(ui.make_due_id("card"), "data"))
    def show(session: Session, _: object) -> list[Component]:
        """Draw the text of the open card."""
        work = session.work
        if work.opened is None or work.opened.card is None or work.card is None:
            return []
        return _build_edit_form(work.card.path.name, session.read_card_text())


def _build_edit_form(name: str, text: str) -> list[Component]:
    area = dcc.Textarea(id={"part": "entry", "id": _name_key(CARD_TEXT)}, value=text)
    form = [
        html.Summary("Edit the open card"),
        html.Label([html.Span("Text of the card", className="label"), area], className="field"),
        build_writing("entry", "Name of the edited card", name, "Write and open the edited card"),
    ]
    return [html.Details(form, id="edit-form")]


_CARDS = (".toml",)
_HEAD = 64 * 2**10
"""Bytes of a file that are searched for the tables of a vehicle card."""
_TABLES = tuple(
    re.compile(rb"^[ \t]*" + one, re.MULTILINE)
    for one in (rb"(?:\[\[[ \t]*gears\b|gears[ \t]*=)", rb"(?:\[[ \t]*inertia\b|inertia[ \t]*[.=])")
)
"""Tables that a vehicle card has, and a gearbox card, a mapping or a twin has not."""
_OTHERS = re.compile(rb"^[ \t]*\[{1,2}[ \t]*(?![\[ \t]|gears\b|final_drive\b)", re.MULTILINE)
"""Head of a table that a card of the ratios alone has not."""


def layout() -> list[Component]:
    """Build the ways to a card, and the data of the open one."""
    return [
        ui.make_hint(
            "The vehicle card has the design data: gears, shift elements, ranges of inertias and "
            "the tolerances of the sensors. Bus logs need a card of the ratios alone."
        ),
        ui.make_row(
            html.Div(
                ui.make_field("card-path", "Vehicle card", type="text", list="card-names"),
                className="wide",
            ),
            ui.make_button("Open card", "open-card", main=True),
            ui.make_upload_button("Upload a card…", "card", "card-upload"),
        ),
        html.Datalist(id="card-names"),
        dcc.Store(id="card-upload"),
        html.Div(id="card-files"),
        html.Div(id="card-content"),
        html.Div(id="edit-content"),
        html.H3("New card"),
        ui.make_row(ui.make_button("Begin a card from the log", "begin-card")),
        html.Div(id="form-content"),
    ]


def register(page: ui.Page) -> None:
    """Register opening, and the data of the open card."""
    register_opening(page, "card", "card-file", open_card)
    _register_edit(page)
    _register_form(page)
    _register_writing(page, "question", Session.write_card)
    _register_writing(page, "entry", Session.write_edited_card)

    @page.callback(
        Output("card-content", "children"),
        Output("card-path", "value"),
        Output("card-names", "children"),
        Output("card-files", "children"),
        Input(ui.make_due_id("card"), "data"),
    )
    def show(session: Session, _: str) -> tuple[Any, ...]:
        """Render the open card and the cards of the folder."""
        work = session.work
        content = [] if work.opened is None else _build_content(work.opened)
        names = session.folder.list_names(_CARDS)
        options = [html.Option(value=name) for name in names]
        cards = [name for name in names if is_card(session.folder.root / name)]
        files = build_file_buttons("card-file", "vehicle card", cards)
        # Without an open card the field keeps the text that was typed while the page loaded.
        path = no_update if work.card is None else format_source(work.card)
        return content, path, options, files


def open_card(session: Session, source: Source) -> None:
    """Open a card for the log of the session, and show what came of it."""
    session.open_card(source)
    ui.notify_topic(ui.Topic.LOG)
    ui.notify_opened_log(f"{source.name} is open", session.work.require_open_log())


def is_card(path: Path) -> bool:
    """Return True for a file that has the tables of a vehicle card or those of a card of the ratios
    alone; it may still have faults."""
    try:
        with path.open("rb") as file:
            head = file.read(_HEAD)
    except OSError:
        return False
    gears, inertia = (one.search(head) for one in _TABLES)
    return bool(gears and (inertia or not _OTHERS.search(head)))


def _build_content(opened: Opened) -> list[Component]:
    if opened.ratios is not None:
        tables = [render_table(one) for one in build_ratio_tables(opened.ratios)]
        return [html.Div(tables, className="columns")]
    if opened.card is None:
        return []
    doubts = map(replace_options, render(opened.doubts))
    tables = [render_table(one) for one in build_card_tables(opened.card)]
    return [
        ui.make_notes("Implausible on this card", doubts),
        html.Div(tables, className="columns"),
    ]
