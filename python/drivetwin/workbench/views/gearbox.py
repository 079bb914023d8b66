# SPDX-License-Identifier: MIT
"""Gearbox: members, ratios, application table, and a shift reduced to the dual-clutch form."""

from __future__ import annotations

from itertools import pairwise

from dash import Input, Output, State, dcc, html, no_update
from dash.development.base_component import Component

from drivetwin.errors import InputError
from drivetwin.gearbox import Gearbox, list_builtin_gearboxes, reduce, solve_gear
from drivetwin.report.gearbox import (
    ReducedShift,
    build_member_tables,
    build_ratio_table,
    build_reduction_blocks,
    evaluate_reduction,
)
from drivetwin.workbench.session import Session
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.blocks import render_block
from drivetwin.workbench.views.fields import UploadField

_FIRST = "three-set-4000cr"


def layout() -> list[Component]:
    """Return the controls for choosing a gearbox, and its description."""
    names = list_builtin_gearboxes()
    return [
        ui.make_hint(
            "A built-in gearbox, or a gearbox card of the folder. Ratios are computed from the "
            "members. A shift is reduced to two speeds, with the error of the reduction."
        ),
        ui.make_row(
            ui.make_choice(
                "gearbox-builtin", "Built-in", {"": "–", **{n: n for n in names}}, _FIRST
            ),
            html.Div(
                ui.make_field("gearbox-path", "or gearbox card", type="text", list="card-names"),
                className="wide",
            ),
            ui.make_upload_button("Upload a card…", "gearbox", "gearbox-upload"),
            ui.make_button("Show", "show-gearbox", main=True),
        ),
        dcc.Store(id="gearbox-upload"),
        html.Div(id="gearbox-content"),
    ]


def register(page: ui.Page) -> None:
    """Choosing a gearbox and a shift of it."""

    @page.callback(
        Input("show-gearbox", "n_clicks"),
        Input("gearbox-upload", "data"),
        State("gearbox-builtin", "data-value"),
        State("gearbox-path", "value"),
    )
    def choose(
        session: Session, _: object, upload: UploadField | None, builtin: str, path: str | None
    ) -> None:
        """Load a card: the one typed, else the upload, else the built-in one."""
        if path:
            session.open_gearbox(session.get_folder_source(path))
        elif upload is not None:
            session.open_gearbox(session.get_uploaded(upload.key))
        else:
            session.open_gearbox(builtin)
        ui.notify_topic(ui.Topic.GEARBOX)

    @page.callback(Output("gearbox-content", "children"), Input(ui.make_due_id("gearbox"), "data"))
    def show(session: Session, _: object) -> list[Component]:
        """All of the gearbox."""
        box = session.gearbox
        return [] if box is None else _build_content(box)

    @page.callback(
        Output("reduction", "children"), Input("gearbox-shift", "data-value"), initially=True
    )
    def show_reduction(session: Session, shift: str | None) -> object:
        """One shift as a dual clutch."""
        box = session.gearbox
        return (
            no_update
            if box is None or shift is None
            else [
                render_block(one, "reduction")
                for one in build_reduction_blocks(reduce_shift(box, shift))
            ]
        )


def _build_content(box: Gearbox) -> list[Component]:
    gears = [solve_gear(box, one.name) for one in box.gears]
    shifts = {name: name for name in list_shifts(box)}
    return [
        html.H3(box.name),
        ui.make_hint(box.source),
        render_block(build_ratio_table(box, gears), "application"),
        html.H3("Reduction of a shift"),
        ui.make_row(ui.make_choice("gearbox-shift", "Shift", shifts, next(iter(shifts)))),
        html.Div(id="reduction"),
        html.H3("Members"),
        *(render_block(one, "members") for one in build_member_tables(box)),
    ]


def list_shifts(box: Gearbox) -> dict[str, tuple[str, str]]:
    """Neighbouring gears (old, new) by the name of their shift, such as `2-3`."""
    return {f"{old.name}-{new.name}": (old.name, new.name) for old, new in pairwise(box.gears)}


def reduce_shift(box: Gearbox, shift: str) -> ReducedShift:
    """One shift in the dual-clutch form.

    Raises InputError for a text that is no shift, ReductionError where there is no such form.
    """
    shifts = list_shifts(box)
    if shift not in shifts:
        raise InputError(f"{shift!r} is no shift", f"choose one of {', '.join(shifts)}")
    return evaluate_reduction(reduce(box, *shifts[shift]))
