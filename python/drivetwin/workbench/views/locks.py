# SPDX-License-Identifier: MIT
"""Locks: prior knowledge of parameters for the next identification, in tables and at sliders."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from enum import StrEnum

from dash import ALL, Input, State, ctx, html, set_props
from dash.development.base_component import Component

from drivetwin._util.display_units import get_display_unit
from drivetwin.errors import InputError, Where
from drivetwin.parameters import get_parameter_spec
from drivetwin.report.blocks import Cell, make_table
from drivetwin.report.figure import get_parameter_label, get_parameter_name
from drivetwin.report.parameters import build_parameter_table
from drivetwin.vehicle.locks import Lock, LockKind, can_fix
from drivetwin.workbench.session import Session
from drivetwin.workbench.session_state import SessionState
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.fields import ControlId, get_triggered_part
from drivetwin.workbench.views.widgets import render_table


def parse_lock(parameter_id: str, kind: LockKind, value: float | None, std: float | None) -> Lock:
    """The lock of numbers in display units; None where a field is empty.

    Raises InputError where no value is stated that is needed.
    """
    if kind is LockKind.FREE:
        return Lock(kind)
    if value is None:
        raise InputError("no value is stated", "type one first", Where(key=parameter_id))
    factor = get_display_unit(get_parameter_spec(parameter_id).unit).factor
    return Lock(kind, value / factor, (std or 0.0) / factor)


_KINDS = {kind.value: kind.value for kind in LockKind}
HINT = (
    "free: estimated from the log. prior: value ± one standard deviation, like one more "
    "measurement. fixed: the value is exact. Locks are used in the next identification."
)


class Place(StrEnum):
    """Place of the controls of a lock."""

    TABLE = "table"
    """Of a parameter without a slider."""
    SLIDER = "slider"


class LockId(ControlId):
    """Id of a control of a lock: parameter and place."""

    at: Place


def register(page: ui.Page) -> None:
    """Register the change of a lock."""

    @page.callback(
        Input({"lock": "kind", "id": ALL, "at": ALL}, "data-value"),
        Input({"lock": "value", "id": ALL, "at": ALL}, "value"),
        Input({"lock": "std", "id": ALL, "at": ALL}, "value"),
        State({"lock": "kind", "id": ALL, "at": ALL}, "id"),
    )
    def lock(
        session: Session,
        kinds: Sequence[LockKind],
        values: Sequence[float | None],
        stds: Sequence[float | None],
        ids: Sequence[LockId],
    ) -> None:
        """Set a lock that was changed by hand."""
        if not ctx.triggered_id:
            return
        name, at = get_triggered_part("id"), get_triggered_part("at")
        row = next((k for k, one in enumerate(ids) if (one.id, one.at) == (name, at)), None)
        if row is None:
            return
        value = values[row]
        before = session.work.get_lock(name)
        if at == Place.SLIDER and before.kind is LockKind.FREE and kinds[row] is not before.kind:
            value = _take_slider(session.work, name, value)
        wanted = parse_lock(name, kinds[row], value, stds[row])
        if _is_same(wanted, before):
            ui.notify("")
            return
        session.update(lambda work: work.set_lock(name, wanted))
        if at == Place.SLIDER:
            ui.notify_topic(ui.Topic.LOCKS)
        ui.notify(f"{get_parameter_label(name)} is {wanted.kind.value} in the next identification")


def _take_slider(work: SessionState, name: str, value: float | None) -> float | None:
    """Return the number of a moved slider, and write it into the field of its lock."""
    if name not in work.changes:
        return value
    factor = get_display_unit(get_parameter_spec(name).unit).factor
    moved = float(f"{work.changes[name] * factor:.6g}")
    set_props({"lock": "value", "id": name, "at": Place.SLIDER.value}, {"value": moved})
    return moved


def build_table(work: SessionState, names: Iterable[str]) -> Component:
    """Build the table of parameters with the control of the lock of each."""
    listed = list(names)
    if work.result:
        estimates = work.require_twin().parameters
        block = build_parameter_table({name: estimates[name] for name in listed}, "")
    else:
        meanings = (get_parameter_spec(name).meaning for name in listed)
        named = (
            Cell(get_parameter_name(name), note=text)
            for name, text in zip(listed, meanings, strict=True)
        )
        block = make_table("", ("parameter",), ((one,) for one in named))
    controls = [
        [build_controls(work, name, Place.TABLE) if can_fix(name) else "follows from others"]
        for name in listed
    ]
    return render_table(block, ["lock"], controls, "locks")


def list_default_ids(work: SessionState) -> list[str]:
    """List the parameters that can be fixed before an identification."""
    gears = dict.fromkeys(g for s in work.all_shifts for g in (s.start_gear, s.end_gear))
    elements = dict.fromkeys(e for s in work.all_shifts for e in (s.offgoing, s.oncoming))
    return [
        "eta",
        *(f"J_prime_{gear}" for gear in gears),
        *("J_out", "J_vehicle", "Tv_over_if", "k_o", "c_o", "te_delay"),
        *(f"P0.{element}" for element in elements),
    ]


def build_controls(work: SessionState, name: str, at: Place) -> Component:
    """Build kind, value and standard deviation of the lock of a parameter."""
    estimate = work.require_twin().parameters.get(name) if work.result else None
    lock, factor = work.get_lock(name), get_display_unit(get_parameter_spec(name).unit).factor
    value = estimate.value if estimate is not None else None
    if lock.kind is not LockKind.FREE:
        value = lock.value
    std = lock.std if lock.kind is LockKind.PRIOR else 0.05 * abs(value or 0.0)
    label = get_parameter_label(name)

    def number(part: str, text: str, sign: str, value: float | None) -> Component:
        shown = None if value is None else float(f"{value * factor:.6g}")
        field = ui.make_field(
            {"lock": part, "id": name, "at": at.value},
            f"{text} of {label}",
            hidden_label=True,
            type="number",
            debounce=True,
            step="any",
            value=shown,
        )
        return html.Span([sign, field], className=f"part {part}")

    choice = ui.make_choice(
        {"lock": "kind", "id": name, "at": at.value},
        f"lock of {label}",
        _KINDS,
        lock.kind,
        hidden_label=True,
    )
    parts = [choice, number("value", "locked value", "at", value)]
    return html.Div([*parts, number("std", "standard deviation", "±", std)], className="lock")


def _is_same(one: Lock, other: Lock) -> bool:
    if one.kind is not other.kind or one.kind is LockKind.FREE:
        return one.kind is other.kind
    near = abs(one.value - other.value) <= 1e-5 * abs(other.value)
    return near and abs(one.std - other.std) <= 1e-5 * abs(other.std)
