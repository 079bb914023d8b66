# SPDX-License-Identifier: MIT
"""Gearbox: members, ratios, application table, and a shift reduced to the dual-clutch form."""

from __future__ import annotations

from dash import Input, Output, State, dcc, html, no_update
from dash.development.base_component import Component

from drivetwin._util.display_units import NM, RPM, format_significant
from drivetwin.gearbox import Gearbox, list_builtin_gearboxes
from drivetwin.workbench.gearboxes import (
    ReducedShift,
    list_gears,
    list_members,
    list_shifts,
    reduce_shift,
)
from drivetwin.workbench.session import Session
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.fields import UploadField

_ROUND_OFF = 1e-12
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
    def reduce(session: Session, shift: str | None) -> object:
        """One shift as a dual clutch."""
        box = session.gearbox
        return (
            no_update
            if box is None or shift is None
            else _build_reduction(reduce_shift(box, shift))
        )


def _build_content(box: Gearbox) -> list[Component]:
    gears = list_gears(box)
    application: list[list[ui.Content]] = [
        [
            one.name,
            *(
                html.Div("●" if e in one.elements else "", className="engaged")
                for e in box.elements
            ),
            _align_right(f"{one.ratio:.4f}"),
            _align_right(f"{one.published:.4g}"),
            _align_right(f"{100 * one.difference:+z.2f} %"),
        ]
        for one in gears
    ]
    members: list[list[ui.Content]] = [
        [
            one.name,
            _align_right(f"{one.inertia:.4g}" if one.inertia else "–"),
            ", ".join(one.joined),
        ]
        for one in list_members(box)
    ]
    sets: list[list[ui.Content]] = [
        [one.name, one.sun, one.ring, one.carrier, _align_right(f"{one.z:.4g}")] for one in box.sets
    ]
    shifts = {name: name for name in list_shifts(box)}
    head = ("gear", *box.elements, "ratio", "published", "difference")
    return [
        html.H3(box.name),
        ui.make_hint(box.source),
        ui.make_table(head, application, "Application table: ● is engaged.", "application"),
        html.H3("Reduction of a shift"),
        ui.make_row(ui.make_choice("gearbox-shift", "Shift", shifts, next(iter(shifts)))),
        html.Div(id="reduction"),
        html.H3("Members"),
        *(
            [ui.make_table(("set", "sun", "ring", "carrier", "z"), sets, "Planetary sets.")]
            if sets
            else []
        ),
        ui.make_table(("member", "inertia [kg·m²]", "joined by"), members),
    ]


def _build_reduction(found: ReducedShift) -> list[Component]:
    one = found.reduction
    elements: list[list[ui.Content]] = [
        [
            each.element,
            role,
            *(_align_right(f"{x:.4f}") for x in (each.i_c, each.i_out, each.ratio)),
        ]
        for role, each in (("off-going", one.off_going), ("on-coming", one.on_coming))
    ]
    elements += [[name, "engaged throughout", "", "", ""] for name in one.common]
    members: list[list[ui.Content]] = [
        [
            each.member,
            _align_right(f"{each.inertia:.4g}"),
            *(_align_right(_format_number(value)) for value in (each.a, each.b, each.coupling)),
        ]
        for each in one.members
    ]
    mass: list[list[ui.Content]] = [
        ["ω_in", _align_right(_format_number(one.M11)), _align_right(_format_number(one.M12))],
        ["ω_out", _align_right(_format_number(one.M12)), _align_right(_format_number(one.M22))],
    ]
    return [
        ui.make_hint(one.describe_condition()),
        ui.make_table(("element", "", "i_c", "i_out", "i_c·i_out"), elements,
              "slip = ω_in/i_c − i_out·ω_out (eq. 15)"),
        ui.make_table(("mass matrix [kg·m²]", "ω_in", "ω_out"), mass),
        ui.make_table(("member", "inertia [kg·m²]", "a", "b", "to M12"), members,
              "Members that move: ω = a·ω_in − b·ω_out."),
        _build_error_table(found),
    ]  # fmt: skip


def _build_error_table(found: ReducedShift) -> Component:
    if found.reduction.exact:
        return ui.make_hint("Nothing couples the two shafts: the reduced form is exact.")
    if found.estimated is None or found.simulated is None:
        return ui.make_hint(f"The error of neglecting M12 is not known: {found.reason}")
    rows: list[list[ui.Content]] = [
        [
            label,
            *(
                _align_right(
                    f"{format_significant(getattr(each, name) * unit.factor, 3)} {unit.label}"
                )
                for each in (found.estimated, found.simulated)
            ),
        ]
        for label, name, unit in (
            ("shaft torque", "shaft_torque", NM),
            ("input speed", "input_speed", RPM),
            ("output speed", "output_speed", RPM),
        )
    ]
    caption = "Largest error over the reference shift of the card if M12 is neglected."
    return ui.make_table(("signal", "estimated", "simulated"), rows, caption)


def _format_number(value: float) -> str:
    """Format a number to four digits; round-off relative to 1 becomes zero."""
    return "0" if abs(value) < _ROUND_OFF else f"{value:.4g}"


def _align_right(text: str) -> Component:
    return html.Div(text, className="number")
