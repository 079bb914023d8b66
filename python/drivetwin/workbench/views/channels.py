# SPDX-License-Identifier: MIT
"""Channels: the role of each column, its correction, and a preview of any column."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

from dash import ALL, Input, Output, State, html
from dash.development.base_component import Component

from drivetwin._util.display_units import Display
from drivetwin.channels.units import list_time_spellings
from drivetwin.errors import InputError
from drivetwin.logs.survey import Column
from drivetwin.report.figure import MEASURED, Figure
from drivetwin.report.inputs import build_column_table
from drivetwin.report.stack import Curve, Panel, compute_full_range, plot_over_time_axis
from drivetwin.report.validation import build_log_panels, plot_log
from drivetwin.workbench.forms import Entry, Row, list_roles, list_rows, list_unit_names
from drivetwin.workbench.sandboxed_parse import Opened, Preview
from drivetwin.workbench.session import Session
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.export import Record
from drivetwin.workbench.views.fields import Index
from drivetwin.workbench.views.log import Place, build_log_choice, register_log_choice
from drivetwin.workbench.views.widgets import render_table, replace_options

_PREVIEW_HEIGHT = 330
_PROPOSED = (
    "The file names no unit for some columns. The table has the units that fit their values: check "
    "them, then apply."
)
_SIGNS = {"+": "as recorded", "-": "reversed"}


def layout() -> list[Component]:
    """Build the table of columns, the preview, and the channels as read."""
    return [
        ui.make_hint(
            "Each column of the file with its proposed role. Correct role, unit or sign, then "
            "apply: the log is read again. Set 'not used' to ignore a column."
        ),
        html.Datalist([html.Option(value=name) for name in list_time_spellings()], id="time-units"),
        html.Datalist([html.Option(value=name) for name in list_unit_names()], id="unit-names"),
        html.Div(id="channels-content"),
        html.H3("Preview of a column"),
        html.Div(id="preview-choice"),
        html.Div(id="preview-content"),
        html.Div(id="channels-figure"),
    ]


def register(page: ui.Page) -> None:
    """Register the callbacks that show and correct the mapping."""
    _register_preview(page)
    register_log_choice(page, Place.CHANNELS)
    ui.register_zoom(page, "preview-plot", _get_preview_panels)
    ui.register_zoom(
        page, "channels-plot", lambda session: build_log_panels(session.work.require_log())
    )

    @page.callback(
        Output("channels-content", "children"),
        Output("preview-choice", "children"),
        Output("preview-content", "children", allow_duplicate=True),
        Output("channels-figure", "children"),
        Input(ui.make_due_id("channels"), "data"),
    )
    def show(session: Session, _: object) -> tuple[list[Component], ...]:
        """Columns, faults and the channels over time."""
        opened = session.work.opened
        if opened is None:
            return [], [], [], []
        choice = build_log_choice(session.work, Place.CHANNELS)
        content = [*choice, *_build_content(opened)]
        return content, [_build_choice(opened)], [], _build_figure(opened)

    @page.callback(
        Input("apply-mapping", "n_clicks"),
        State({"part": "role", "column": ALL}, "data-value"),
        State({"part": "unit", "column": ALL}, "value"),
        State({"part": "sign", "column": ALL}, "data-value"),
        State("time-unit", "value"),
        busy="apply-mapping",
    )
    def apply(
        session: Session,
        clicks: int | None,
        roles: Sequence[str],
        units: Sequence[str | None],
        signs: Sequence[Literal["+", "-"]],
        time_unit: str | None,
    ) -> None:
        """Read the log with the mapping as it stands in the table."""
        if not clicks:
            return
        session.correct_mapping(
            [
                Entry(role, unit or "", sign == "-")
                for role, unit, sign in zip(roles, units, signs, strict=True)
            ],
            time_unit or "",
        )
        ui.notify_topic(ui.Topic.LOG)
        ui.notify_opened_log("The log is read as mapped", session.work.require_open_log())


def _build_content(opened: Opened) -> list[Component]:
    roles = {"": "not used", **{role: role for role in list_roles(opened.survey)}}
    listed = list_rows(opened.survey)
    controls = [_build_controls(number, one, roles) for number, one in enumerate(listed)]
    table = build_column_table(opened.survey.columns, with_roles=False)
    proposed = [_PROPOSED] if any(one.proposed for one in listed) else []
    return [
        ui.make_notes(
            "The log cannot be read as mapped", filter(None, [replace_options(opened.fault)])
        ),
        ui.make_notes("About the columns", [*proposed, *map(replace_options, opened.survey.notes)]),
        render_table(table, ("role", "unit", "sign"), controls, "mapping"),
        _build_time_unit(opened),
        ui.make_row(
            ui.make_button("Apply the mapping", "apply-mapping", main=True),
            ui.make_button(
                "Download the mapping", {"export": Record.MAPPING.value, "at": "channels"}
            ),
        ),
    ]


def _build_time_unit(opened: Opened) -> Component:
    """Build the field of the unit of time, filled with the unit that the sampling steps suggest."""
    likely = "; ".join(f"{one.unit}: {one.reason}" for one in opened.time_units)
    hint = likely or "Leave it empty to use the unit that the file states."
    unit = opened.survey.options.time.unit or ""
    if len(opened.time_units) == 1:
        unit = opened.time_units[0].unit
    return ui.make_row(
        ui.make_field(
            "time-unit", "Unit of the time column", type="text", value=unit, list="time-units",
            size="8",
        ),
        ui.make_hint(hint),
    )  # fmt: skip


def _build_choice(opened: Opened) -> Component:
    """Build the choice of the column to preview."""
    columns = {str(k): _name_column(one) for k, one in enumerate(opened.survey.columns)}
    return ui.make_row(ui.make_choice("preview", "Column", {"": "none", **columns}, ""))


def _build_figure(opened: Opened) -> list[Component]:
    if opened.log is None:
        return []
    graph = ui.make_graph(
        "channels-plot", "All channels over time", plot_log(opened.log), cursors=True
    )
    return [html.H3("Channels as read"), graph]


def _register_preview(page: ui.Page) -> None:
    @page.callback(Output("preview-content", "children"), Input("preview", "data-value"))
    def preview(session: Session, column: Index | Literal[""] | None) -> list[Component]:
        """Draw a column as recorded, whether it has a role or not."""
        if not column:
            return []
        shown = session.read_column(int(column))
        graph = ui.make_graph(
            "preview-plot", f"{shown.name} over time", plot_preview(shown), cursors=True
        )
        return [graph]


def plot_preview(shown: Preview) -> Figure:
    """Draw a column over time in the unit of the file."""
    panels = build_preview_panels(shown)
    return plot_over_time_axis(panels, compute_full_range(panels), _PREVIEW_HEIGHT)


def build_preview_panels(shown: Preview) -> list[Panel]:
    """Return the panel of `plot_preview`."""
    curve = Curve(shown.name, shown.time, shown.values, MEASURED)
    return [Panel(shown.name, Display(shown.unit or "no unit"), [curve])]


def _get_preview_panels(session: Session) -> list[Panel]:
    if session.preview is None:
        raise InputError("no column is shown", "choose one for the preview")
    return build_preview_panels(session.preview[1])


def _name_column(column: Column) -> str:
    return f"{column.name} ({column.group})" if column.group else column.name


def _build_controls(number: int, one: Row, roles: dict[str, str]) -> list[Component]:
    """Build the controls of a column: role, unit and sign."""
    name = _name_column(one.column)

    def part(of: str) -> dict[str, str | int]:
        return {"part": of, "column": number}

    return [
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
