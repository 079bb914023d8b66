# SPDX-License-Identifier: MIT
"""Channels: what each column is taken for, and how that is corrected."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from dash import ALL, Dash, Input, Output, State, html
from dash.development.base_component import Component

from drivetwin.report.figures.recording import log_figure
from drivetwin.workbench.mapping import Entry, Row, roles_of, rows_of, unit_names
from drivetwin.workbench.sandboxed_parse import Opened
from drivetwin.workbench.session import Sessions
from drivetwin.workbench.views.widgets import (
    Topic,
    acted,
    announce,
    button,
    choice,
    due_id,
    field,
    graph,
    hint,
    notes,
    row,
    table,
    tell_read,
    told,
)

_SIGNS = {"+": "as recorded", "-": "reversed"}


def layout() -> list[Component]:
    """The table of columns, and the channels as read."""
    return [
        hint(
            "Every column of the file with the role that it is proposed for. Correct role, unit or "
            "sign and apply: the log is then read again. An empty role leaves a column aside."
        ),
        html.Datalist([html.Option(value=name) for name in unit_names()], id="unit-names"),
        html.Div(id="channels-content"),
    ]


def register(app: Dash, sessions: Sessions) -> None:
    """Showing and correcting the mapping."""

    @app.callback(
        Output("channels-content", "children"),
        Input(due_id("channels"), "data"),
        State("session", "data"),
        prevent_initial_call=True,
    )
    @told
    def show(_: int, key: str) -> list[Component]:
        """Columns, faults and the channels over time."""
        opened = sessions.get(key).work.opened
        return [hint("No log is open.")] if opened is None else _content(opened)

    @app.callback(
        Input("apply-mapping", "n_clicks"),
        State("session", "data"),
        State({"part": "role", "column": ALL}, "data-value"),
        State({"part": "unit", "column": ALL}, "value"),
        State({"part": "sign", "column": ALL}, "data-value"),
        running=[(Output("apply-mapping", "disabled"), True, False)],
        prevent_initial_call=True,
    )
    @acted
    def apply(
        clicks: int | None,
        key: str,
        roles: Sequence[str],
        units: Sequence[str | None],
        signs: Sequence[str],
    ) -> None:
        """Read the log with the mapping as it stands in the table."""
        if not clicks:
            return
        session = sessions.get(key)
        session.correct(
            [
                Entry(role, unit or "", sign == "-")
                for role, unit, sign in zip(roles, units, signs, strict=True)
            ]
        )
        opened = session.work.require_opened()
        announce(Topic.LOG)
        tell_read("The log is read as mapped", opened.fault, len(session.work.shifts))


def _content(opened: Opened) -> list[Component]:
    roles = {"": "not used", **{role: role for role in roles_of(opened.card)}}
    rows = [_row(number, one, roles) for number, one in enumerate(rows_of(opened.survey))]
    head = ("column", "unit in the file", "Hz", "least", "greatest", "gaps", "role", "unit", "sign")
    content = [
        notes("The log cannot be read as mapped", [opened.fault] if opened.fault else []),
        notes("About the columns", opened.survey.notes),
        table(head, rows, name="mapping"),
        row(button("Apply the mapping", "apply-mapping", main=True)),
    ]
    if opened.log is not None:
        figure = log_figure(opened.log)
        content.append(graph("channels-plot", "All channels over time", figure))
    return content


def _row(number: int, one: Row, roles: dict[str, str]) -> list[Any]:
    column = one.column
    low, high = column.range or (None, None)
    name = f"{column.name} ({column.group})" if column.group else column.name

    def part(of: str) -> dict[str, str | int]:
        return {"part": of, "column": number}

    return [
        name,
        column.unit or "none",
        _number(column.rate),
        _number(low),
        _number(high),
        str(column.gaps) if column.gaps else "–",
        choice(part("role"), f"role of {name}", roles, one.role, hidden_label=True),
        field(
            part("unit"),
            f"unit of {name}",
            hidden_label=True,
            type="text",
            value=one.unit,
            list="unit-names",
            size="8",
        ),
        choice(
            part("sign"), f"sign of {name}", _SIGNS, "-" if one.reversed else "+", hidden_label=True
        ),
    ]


def _number(value: float | None) -> Component:
    return html.Div("–" if value is None else f"{value:.4g}", className="number")
