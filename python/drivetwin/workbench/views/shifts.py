# SPDX-License-Identifier: MIT
"""Shifts: those of the log, and the phase boundaries of one, dragged or typed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from enum import StrEnum
from typing import Any

from dash import ALL, Input, Output, State, html
from dash.development.base_component import Component

from drivetwin.findings import render
from drivetwin.report.blocks import TableBlock, make_table
from drivetwin.report.bus import build_phase_table as build_bus_phases
from drivetwin.report.stack import Panel
from drivetwin.report.summary import build_phase_table, describe_phases
from drivetwin.report.validation import build_shift_panels
from drivetwin.report.whole_drive import build_quality_tables, build_summary_tables
from drivetwin.shifts.shift import Shift, make_shift_labels
from drivetwin.shifts.summary import summarize_shifts
from drivetwin.workbench.identifying import (
    LABELS,
    get_display_times,
    parse_drag,
    parse_times,
    plot_phases,
)
from drivetwin.workbench.session import Session
from drivetwin.workbench.session_state import OpenLog, SessionState
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.fields import ControlId, Index
from drivetwin.workbench.views.log import Place, build_log_choice, register_log_choice
from drivetwin.workbench.views.widgets import render_table, replace_options


class Use(StrEnum):
    """Use of a shift in the identification."""

    FIT = "fit"
    HOLD_OUT = "hold out"


_HOLD_OUT = (
    "Shifts held out take no part in the fit. The model identified from the others predicts them, "
    "and the step Identify compares the prediction with the measurement."
)
_HOLD_OUT_BUS = "The decays of a log held out are predicted by the other logs."


def layout() -> list[Component]:
    """Build the list of shifts, and the phases of one."""
    return [
        html.Div(id="shifts-content"),
        html.Div(id="phases-content"),
    ]


def register(page: ui.Page) -> None:
    """Register the callbacks by which boundaries are moved and shifts held out."""
    register_log_choice(page, Place.SHIFTS)
    ui.register_zoom(page, "phases-plot", _get_phase_panels)
    _register_uses(page)
    _register_figure(page)
    _register_fields(page)


def _register_figure(page: ui.Page) -> None:
    @page.callback(
        Output("shifts-content", "children"),
        Output("phases-content", "children"),
        Input(ui.make_due_id("shifts"), "data"),
    )
    def show(session: Session, _: object) -> tuple[list[Component], list[Component]]:
        """List all shifts, and draw the one that is chosen."""
        work = session.work
        content = _build_content(work) if work.shifts else _build_other_log(work)
        return _build_shifts(work), content

    @page.callback(Input("phases-plot", "relayoutData"))
    def drag(session: Session, change: dict[str, Any] | None) -> None:
        """A line was dragged."""
        work = session.work
        if not change or not any(name.startswith("shapes[") for name in change):
            return
        moves = parse_drag(plot_phases(work.require_log(), work.require_shift()), change)
        ui.notify_topic(ui.Topic.PHASES)
        if moves:
            session.update(lambda work: work.apply_moves(work.shift, moves))
            ui.notify("; ".join(f"{LABELS[one]} at {time:z.4f} s" for one, time in moves.items()))


def _get_phase_panels(session: Session) -> list[Panel]:
    return build_shift_panels(session.work.require_log(), session.work.require_shift())


def _register_uses(page: ui.Page) -> None:
    @page.callback(
        Input({"part": "use", "id": ALL}, "data-value"), State({"part": "use", "id": ALL}, "id")
    )
    def choose_uses(session: Session, uses: Sequence[Use], ids: Sequence[ControlId]) -> None:
        """Fit a shift, or hold it out."""
        chosen = {one.id for one, use in zip(ids, uses, strict=True) if use is Use.HOLD_OUT}
        logs = session.work.logs
        held = [
            frozenset(k for k in range(one.parts) if _make_use_id(at, k) in chosen)
            for at, one in enumerate(logs)
        ]
        if not ids or held == [one.held for one in logs]:
            return
        session.update(lambda work: work.hold_out(held))
        ui.notify_topic(ui.Topic.HELD)
        ui.notify(
            _describe_held_out(len(chosen), "shift" if session.work.ratios is None else "log")
        )


def _describe_held_out(count: int, part: str) -> str:
    if count == 0:
        return f"The next identification fits all {part}s"
    parts = f"1 {part}" if count == 1 else f"{count} {part}s"
    return f"The next identification predicts {parts} instead of fitting"


def _make_use_id(log: int, shift: int) -> str:
    return f"{log}:{shift}"


def _register_fields(page: ui.Page) -> None:
    @page.callback(Input("apply-phases", "n_clicks"), State({"boundary": ALL}, "value"))
    def apply(session: Session, clicks: int | None, times: Sequence[float | None]) -> None:
        """Times were typed."""
        if not clicks:
            return
        changes = parse_times(session.work.require_shift(), times)
        if not changes:
            ui.notify("No time was changed")
            return
        session.update(lambda work: work.apply_moves(work.shift, changes))
        ui.notify_topic(ui.Topic.PHASES)
        ui.notify("The phases are set")

    @page.callback(Input("reset-phases", "n_clicks"))
    def reset(session: Session, clicks: int | None) -> None:
        """Back to what was detected."""
        if not clicks:
            return
        session.update(lambda work: work.apply_moves(work.shift, {}))
        ui.notify_topic(ui.Topic.PHASES)
        ui.notify("The phases are as detected")

    @page.callback(Input("phases-shift", "data-value"))
    def choose(session: Session, shift: Index | None) -> None:
        """Another shift of the log."""
        if shift is not None and int(shift) != session.work.shift:
            session.update(lambda work: work.select_shift(int(shift)))
            ui.notify_topic(ui.Topic.PHASES)


def _build_shifts(work: SessionState) -> list[Component]:
    """List the shifts of all logs, and the reasons why other gear changes are not used."""
    if work.ratios is not None:
        return _build_bus_logs(work)
    rejected = [text for one in work.logs for text in _list_rejected(work, one)]
    if not work.all_shifts:
        return [ui.make_notes("No usable shift", rejected, "doubtful")]
    rows: list[tuple[object, ...]] = []
    uses: list[list[Component]] = []
    for at, one in enumerate(work.logs):
        for k, (label, shift) in enumerate(
            zip(make_shift_labels(one.shifts), one.shifts, strict=True)
        ):
            elements = f"{shift.offgoing} → {shift.oncoming}"
            times = (shift.torque_phase[0], shift.lockup_time)
            rows.append((label, one.source.name, shift.kind.value, elements, *times))
            uses.append([_build_use(f"shift {label} of {one.source.name}", at, k, k in one.held)])
    columns = ("shift", "log", "kind", "elements", ("starts [s]", "z.3f"), ("locks [s]", "z.3f"))
    table = make_table("Shifts of all logs", columns, rows)
    several = len(rows) > 1
    return [
        *([ui.make_hint(_HOLD_OUT)] if several else []),
        render_table(table, ["use"], uses) if several else render_table(table),
        ui.make_notes("Not used", rejected, "plain"),
    ]


def _build_bus_logs(work: SessionState) -> list[Component]:
    """List the bus logs with their use, and the phases of their shifts once identified."""
    shifts = [] if work.bus is None else [render_table(build_bus_phases(work.bus.found.timelines))]
    if len(work.logs) < 2:
        return shifts
    rows = [(one.source.name,) for one in work.logs]
    uses = [[_build_use(one.source.name, at, 0, 0 in one.held)] for at, one in enumerate(work.logs)]
    return [
        ui.make_hint(_HOLD_OUT_BUS),
        render_table(make_table("Bus logs", ("log",), rows), ["use"], uses),
        *shifts,
    ]


def _build_use(name: str, log: int, shift: int, held: bool) -> Component:
    """Build the choice between fit and hold-out of a shift."""
    id: ui.Id = {"part": "use", "id": _make_use_id(log, shift)}
    uses = {one.value: one.value for one in Use}
    chosen = Use.HOLD_OUT if held else Use.FIT
    return ui.make_choice(id, f"use of {name}", uses, chosen.value, hidden_label=True)


def _list_rejected(work: SessionState, log: OpenLog) -> Iterator[str]:
    """Yield the gear changes of a log that are not used, with the reason."""
    where = f"{log.source.name}, " if len(work.logs) > 1 else ""
    for one in () if log.opened.found is None else log.opened.found.rejected:
        span = f"{one.time[0]:z.2f} s to {one.time[1]:z.2f} s"
        yield f"{where}{span}: {replace_options(one.reason)}"


def _build_other_log(work: SessionState) -> list[Component]:
    """Build the way to the shifts of another log where the selected one has none."""
    return [ui.make_row(*build_log_choice(work, Place.SHIFTS))] if work.all_shifts else []


def _build_content(work: SessionState) -> list[Component]:
    shift = work.require_shift()
    names = {str(k): name for k, name in enumerate(make_shift_labels(work.shifts))}
    fields = [
        ui.make_field(
            {"boundary": one.value},
            f"{LABELS[one]} [s]",
            type="number",
            value=time,
            step="any",
        )
        for one, time in get_display_times(shift).items()
    ]
    return [
        html.H3("Phases"),
        ui.make_hint(
            "Drag a dashed line to move a phase boundary, or type its time. Boundaries set by hand "
            "are used in the next identification."
        ),
        ui.make_row(
            *build_log_choice(work, Place.SHIFTS),
            ui.make_choice("phases-shift", "Shift", names, str(work.shift)),
            *fields,
        ),
        ui.make_row(
            ui.make_button("Apply times", "apply-phases", main=True),
            ui.make_button("As detected", "reset-phases"),
        ),
        ui.make_graph(
            "phases-plot",
            "The shift over time with its phases",
            plot_phases(work.require_log(), shift),
            cursors=True,
            edits={"shapePosition": True},
        ),
        ui.make_hint(describe_phases(shift.kind)),
        ui.make_notes("About this shift", render(shift.findings)),
        render_table(build_phase_table(names[str(work.shift)], shift)),
        *map(render_table, build_quality_tables([shift])),
        *map(render_table, _build_summary(work.shifts)),
    ]


def _build_summary(shifts: Sequence[Shift]) -> Sequence[TableBlock]:
    """Build the statistics of all shifts of the log; none for a single shift."""
    return list(build_summary_tables(summarize_shifts(shifts)).values()) if shifts[1:] else []
