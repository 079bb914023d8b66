# SPDX-License-Identifier: MIT
"""Export: a button for every format that a twin has, and for drivetwin's own files."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import fields
from enum import Enum
from typing import Any, get_type_hints

from dash import ALL, Input, Output, State, ctx, dcc, html, no_update
from dash.development.base_component import Component

from drivetwin._util.request import Request, get_arguments
from drivetwin.errors import RefusedError
from drivetwin.export.targets import Target
from drivetwin.export.write import ExportOptions
from drivetwin.workbench.exports import Record, make_product
from drivetwin.workbench.session import Session
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.fields import ControlId, get_triggered_part


def build_choices(request: type[Request]) -> list[Component]:
    """Build the choices of a request, labelled with the help texts of its options."""
    hints, arguments = get_type_hints(request), get_arguments(request)
    return [
        ui.make_choice(
            {"request": request.__name__, "id": one.name},
            arguments[one.name].help,
            {each.value: each.value for each in hints[one.name]},
            one.default.value,
        )
        for one in fields(request)
        if isinstance(one.default, Enum)
    ]


def parse_choices(
    request: type[Request], values: Sequence[str], ids: Sequence[ControlId]
) -> dict[str, Any]:
    """Return the chosen values by argument. Raises RefusedError for a value that is no choice."""
    hints = get_type_hints(request)
    try:
        return {one.id: hints[one.id](value) for one, value in zip(ids, values, strict=True)}
    except (KeyError, TypeError, ValueError):
        raise RefusedError("there is no such choice", "use the controls of the page") from None


RECORDS = {
    Record.REPORT: ("Report", "one offline page with all evidence"),
    Record.TWIN: ("Twin", "twin.toml, for simulate, report and export"),
    Record.RESULT: ("Result", "result.json, or bus.json of bus logs, for other programs"),
    Record.SIGNALS: ("Signals", "measured and simulated, of the shift and sliders in Model (CSV)"),
    Record.MAPPING: ("Channel mapping", "channels.toml, for logs of the same logger"),
}


def layout() -> list[Component]:
    """Two groups of buttons."""
    return [
        ui.make_hint(
            "The result that is shown in the step Model, as identified: sliders do not change it."
        ),
        html.H3("The twin for other programs"),
        ui.make_row(*build_choices(ExportOptions)),
        _build_group({one.value: (one.label, one.text) for one in Target}),
        html.H3("Files of drivetwin"),
        _build_group({record.value: text for record, text in RECORDS.items()}),
        dcc.Download(id="download"),
    ]


def _build_group(entries: dict[str, tuple[str, str]]) -> Component:
    return html.Div(
        [
            html.Button(
                [html.Strong(title), html.Small(text)],
                id={"export": name, "at": "export"},
                type="button",
                className="tall",
            )
            for name, (title, text) in entries.items()
        ],
        className="exports",
    )


def register(page: ui.Page) -> None:
    """Register the callback of the buttons."""
    pattern = {"request": ExportOptions.__name__, "id": ALL}

    @page.callback(
        Output("download", "data"),
        Input({"export": ALL, "at": ALL}, "n_clicks"),
        State(pattern, "data-value"),
        State(pattern, "id"),
    )
    def hand_over(
        session: Session,
        clicks: list[int | None],
        values: tuple[str, ...],
        ids: tuple[ControlId, ...],
    ) -> Any:
        """Write the file and send it to the browser."""
        if not ctx.triggered_id or not any(clicks):
            return no_update
        choices = parse_choices(ExportOptions, values, ids)
        wanted = _parse_choice(get_triggered_part("export"), choices)
        product = make_product(session.work, wanted, session.scratch)
        if wanted is not Record.MAPPING:
            session.note_export()
            ui.notify_topic(ui.Topic.STEPS)
        ui.notify(f"{product.name}: {len(product.content) / 1e3:.0f} kB")
        content = base64.b64encode(product.content).decode()
        return {"content": content, "filename": product.name, "base64": True}


def _parse_choice(name: str, choices: Mapping[str, Any]) -> ExportOptions | Record:
    if name in set(Record):
        return Record(name)
    if name in set(Target):
        return ExportOptions(**{**choices, "to": Target(name)})
    raise RefusedError("there is no such export", "press one of the buttons")
