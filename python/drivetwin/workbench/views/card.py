# SPDX-License-Identifier: MIT
"""Card: open the vehicle card, its data and what is implausible about them."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from dash import Input, Output, dcc, html, no_update
from dash.development.base_component import Component

from drivetwin.findings import render
from drivetwin.report.sections.inputs import build_card_tables, build_ratio_tables
from drivetwin.workbench.page_words import replace_options
from drivetwin.workbench.sandboxed_parse import Opened
from drivetwin.workbench.session import Session
from drivetwin.workbench.session_state import Source
from drivetwin.workbench.views import card_form
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.blocks import render_table
from drivetwin.workbench.views.sources import (
    build_file_buttons,
    format_source,
    register_opening,
)

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
        *card_form.layout(),
    ]


def register(page: ui.Page) -> None:
    """Register opening, and the data of the open card."""
    register_opening(page, "card", "card-file", open_card)
    card_form.register_edit(page)
    card_form.register(page)

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
