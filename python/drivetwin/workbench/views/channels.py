# SPDX-License-Identifier: MIT
"""Channels: what each column is taken for, and how that is corrected."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Literal

from dash import ALL, Input, Output, State, html
from dash.development.base_component import Component

from drivetwin.report.figures.recording import plot_log
from drivetwin.workbench.mapping import Entry, Row, list_roles, list_rows, list_unit_names
from drivetwin.workbench.sandboxed_parse import Opened
from drivetwin.workbench.session import Session
from drivetwin.workbench.views import widgets as ui

_SIGNS = {"+": "as recorded", "-": "reversed"}


def layout() -> list[Component]:
    """The table of columns, and the channels as read."""
    return [
        ui.make_hint(
            "Every column of the file with the role that it is proposed for. Correct role, unit or "
            "sign and apply: the log is then read again. An empty role leaves a column aside."
        ),
        html.Datalist([html.Option(value=name) for name in list_unit_names()], id="unit-names"),
        html.Div(id="channels-content"),
    ]


def register(page: ui.Page) -> None:
    """Showing and correcting the mapping."""

    @page.callback(
        Output("channels-content", "children"), Input(ui.make_due_id("channels"), "data")
    )
    def show(session: Session, _: object) -> list[Component]:
        """Columns, faults and the channels over time."""
        opened = session.work.opened
        return [ui.make_hint("No log is open.")] if opened is None else _build_content(opened)

    @page.callback(
        Input("apply-mapping", "n_clicks"),
        State({"part": "role", "column": ALL}, "data-value"),
        State({"part": "unit", "column": ALL}, "value"),
        State({"part": "sign", "column": ALL}, "data-value"),
        busy="apply-mapping",
    )
    def apply(
        session: Session,
        clicks: int | None,
        roles: Sequence[str],
        units: Sequence[str | None],
        signs: Sequence[Literal["+", "-"]],
    ) -> None:
        """Read the log with the mapping as it stands in the table."""
        if not clicks:
            return
        session.correct_mapping(
            [
                Entry(role, unit or "", sign == "-")
                for role, unit, sign in zip(roles, units, signs, strict=True)
            ]
        )
        opened = session.work.require_opened()
        ui.notify_topic(ui.Topic.LOG)
        ui.notify_opened_log("The log is read as mapped", opened.fault, len(session.work.shifts))


def _build_content(opened: Opened) -> list[Component]:
    roles = {"": "not used", **{role: role for role in list_roles(opened.card)}}
    rows = [_build_row(number, one, roles) for number, one in enumerate(list_rows(opened.survey))]
    head = ("column", "unit in the file", "Hz", "least", "greatest", "gaps", "role", "unit", "sign")
    content = [
        ui.make_notes("The log cannot be read as mapped", [opened.fault] if opened.fault else []),
        ui.make_notes("About the columns", opened.survey.notes),
        ui.make_table(head, rows, name="mapping"),
        ui.make_row(ui.make_button("Apply the mapping", "apply-mapping", main=True)),
    ]
    if opened.log is not None:
        figure = plot_log(opened.log)
        content.append(ui.make_graph("channels-plot", "All channels over time", figure))
    return content


def _build_row(number: int, one: Row, roles: dict[str, str]) -> list[Any]:
    column = one.column
    low, high = column.range or (None, None)
    name = f"{column.name} ({column.group})" if column.group else column.name

    def part(of: str) -> dict[str, str | int]:
        return {"part": of, "column": number}

    return [
        name,
        column.unit or "none",
        _render_number(column.rate),
        _render_number(low),
        _render_number(high),
        str(column.gaps) if column.gaps else "–",
        ui.make_choice(part("role"), f"role of {name}", roles, one.role, hidden_label=True),
        ui.make_field(
            part("unit"),
            f"unit of {name}",
            hidden_label=True,
            type="text",
            value=one.unit,
            list="unit-names",
            size="8",
        ),
        ui.make_choice(
            part("sign"), f"sign of {name}", _SIGNS, "-" if one.reversed else "+", hidden_label=True
        ),
    ]


def _render_number(value: float | None) -> Component:
    return html.Div("–" if value is None else f"{value:.4g}", className="number")
