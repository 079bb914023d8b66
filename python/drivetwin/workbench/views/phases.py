# SPDX-License-Identifier: MIT
"""Phases: the shift with its boundaries, dragged in the figure or typed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from dash import ALL, Input, Output, State, html
from dash.development.base_component import Component

from drivetwin._util.display_units import display_of, significant
from drivetwin.report.sections.summary import phase_key
from drivetwin.shifts.quality import QUALITY_UNITS
from drivetwin.shifts.shift import Shift, shift_labels
from drivetwin.workbench.phases import LABELS, dragged, phase_figure, shown_times, typed
from drivetwin.workbench.session import Session
from drivetwin.workbench.session_state import Work
from drivetwin.workbench.views import widgets as ui


def layout() -> list[Component]:
    """The figure and the times."""
    return [
        ui.hint(
            "Drag a dashed line to move a phase boundary, or type its time. What is set by hand "
            "counts for the next identification."
        ),
        html.Div(id="phases-content"),
    ]


def register(page: ui.Page) -> None:
    """Moving boundaries."""
    _register_figure(page)
    _register_fields(page)


def _register_figure(page: ui.Page) -> None:
    @page.callback(Output("phases-content", "children"), Input(ui.due_id("phases"), "data"))
    def show(session: Session, _: int) -> list[Component]:
        """The shift that is chosen."""
        work = session.work
        return _content(work) if work.shifts else [ui.hint("No shift is open.")]

    @page.callback(Input("phases-plot", "relayoutData"))
    def drag(session: Session, change: dict[str, Any] | None) -> None:
        """A line was dragged."""
        work = session.work
        if not change or not any(name.startswith("shapes[") for name in change):
            return
        moves = dragged(phase_figure(work.require_log(), work.require_shift()), change)
        ui.announce(ui.Topic.PHASES)
        if moves:
            session.move(work.shift, moves)
            ui.tell("; ".join(f"{LABELS[one]} at {time:.4f} s" for one, time in moves.items()))


def _register_fields(page: ui.Page) -> None:
    @page.callback(Input("apply-phases", "n_clicks"), State({"boundary": ALL}, "value"))
    def apply(session: Session, clicks: int | None, times: Sequence[float | None]) -> None:
        """Times were typed."""
        if not clicks:
            return
        changes = typed(session.work.require_shift(), times)
        if not changes:
            ui.tell("No time was changed")
            return
        session.move(session.work.shift, changes)
        ui.announce(ui.Topic.PHASES)
        ui.tell("The phases are set")

    @page.callback(Input("reset-phases", "n_clicks"))
    def reset(session: Session, clicks: int | None) -> None:
        """Back to what was detected."""
        if not clicks:
            return
        session.move(session.work.shift, {})
        ui.announce(ui.Topic.PHASES)
        ui.tell("The phases are as detected")

    @page.callback(Input("phases-shift", "data-value"))
    def choose(session: Session, shift: str | None) -> None:
        """Another shift of the log."""
        if shift is not None and int(shift) != session.work.shift:
            session.choose_shift(int(shift))
            ui.announce(ui.Topic.PHASES)


def _content(work: Work) -> list[Component]:
    shift = work.require_shift()
    names = {str(k): name for k, name in enumerate(shift_labels(work.shifts))}
    fields = [
        ui.field(
            {"boundary": one.value},
            f"{LABELS[one]} [s]",
            type="number",
            value=time,
            step="any",
        )
        for one, time in shown_times(shift).items()
    ]
    return [
        ui.row(ui.choice("phases-shift", "Shift", names, str(work.shift)), *fields),
        ui.row(
            ui.button("Apply times", "apply-phases", main=True),
            ui.button("As detected", "reset-phases"),
        ),
        ui.graph(
            "phases-plot",
            "The shift over time with its phases",
            phase_figure(work.require_log(), shift),
            edits={"shapePosition": True},
        ),
        ui.hint(phase_key(shift.kind)),
        ui.notes("About this shift", shift.warnings),
        _quality(shift),
    ]


def _quality(shift: Shift) -> Component:
    rows = []
    for name, value in shift.quality.items():
        display = display_of(QUALITY_UNITS[name])
        text = f"{significant(value * display.factor, 3)} {display.label}"
        rows.append((name.replace("_", " "), text))
    return ui.table(("figure", "value"), rows, "Shift quality")
