# SPDX-License-Identifier: MIT
"""Gearbox: members, ratios, application table, and a shift reduced to the dual-clutch form."""

from __future__ import annotations

from dash import Dash, Input, Output, State, dcc, html, no_update
from dash.development.base_component import Component

from drivetwin._util.display_units import NM, RPM, significant
from drivetwin.gearbox import Gearbox, builtin_gearboxes
from drivetwin.workbench.gearboxes import ReducedShift, gears_of, members_of, reduced, shifts_of
from drivetwin.workbench.session import Sessions
from drivetwin.workbench.views.widgets import (
    Content,
    Topic,
    acted,
    announce,
    button,
    choice,
    due_id,
    field,
    hint,
    row,
    table,
    told,
    upload_button,
)

_ROUND_OFF = 1e-12
_FIRST = "three-set-4000cr"


def layout() -> list[Component]:
    """Return the controls for choosing a gearbox, and its description."""
    names = builtin_gearboxes()
    return [
        hint(
            "A built-in gearbox, or a gearbox card of the folder. Ratios are computed from the "
            "members; a shift is reduced to two speeds, and the error of that is told."
        ),
        row(
            choice("gearbox-builtin", "Built-in", {"": "–", **{n: n for n in names}}, _FIRST),
            html.Div(
                field("gearbox-path", "or gearbox card", type="text", list="card-names"),
                className="wide",
            ),
            upload_button("Upload a card…", "gearbox", "gearbox-upload"),
            button("Show", "show-gearbox", main=True),
        ),
        dcc.Store(id="gearbox-upload"),
        html.Div(id="gearbox-content"),
    ]


def register(app: Dash, sessions: Sessions) -> None:
    """Choosing a gearbox and a shift of it."""

    @app.callback(
        Input("show-gearbox", "n_clicks"),
        Input("gearbox-upload", "data"),
        State("gearbox-builtin", "data-value"),
        State("gearbox-path", "value"),
        State("session", "data"),
        prevent_initial_call=True,
    )
    @acted
    def choose(
        _: int, upload: dict[str, str] | None, builtin: str, path: str | None, key: str
    ) -> None:
        """Load a card: the one typed, else the upload, else the built-in one."""
        session = sessions.get(key)
        if path:
            session.open_gearbox(session.in_folder(path))
        elif upload is not None:
            session.open_gearbox(session.uploaded(upload["key"]))
        else:
            session.open_gearbox(builtin)
        announce(Topic.GEARBOX)

    @app.callback(
        Output("gearbox-content", "children"),
        Input(due_id("gearbox"), "data"),
        State("session", "data"),
        prevent_initial_call=True,
    )
    @told
    def show(_: int, key: str) -> list[Component]:
        """All of the gearbox."""
        box = sessions.get(key).gearbox
        return [] if box is None else _content(box)

    @app.callback(
        Output("reduction", "children"),
        Input("gearbox-shift", "data-value"),
        State("session", "data"),
    )
    @told
    def reduce(shift: str | None, key: str) -> object:
        """One shift as a dual clutch."""
        box = sessions.get(key).gearbox
        return no_update if box is None or shift is None else _reduction(reduced(box, shift))


def _content(box: Gearbox) -> list[Component]:
    gears = gears_of(box)
    application: list[list[Content]] = [
        [
            one.name,
            *(
                html.Div("●" if e in one.elements else "", className="engaged")
                for e in box.elements
            ),
            _right(f"{one.ratio:.4f}"),
            _right(f"{one.published:.4g}"),
            _right(f"{100 * one.difference:+.2f} %"),
        ]
        for one in gears
    ]
    members: list[list[Content]] = [
        [
            one.name,
            _right(f"{one.inertia:.4g}" if one.inertia else "–"),
            ", ".join(one.joined),
        ]
        for one in members_of(box)
    ]
    sets: list[list[Content]] = [
        [one.name, one.sun, one.ring, one.carrier, _right(f"{one.z:.4g}")] for one in box.sets
    ]
    shifts = {name: name for name in shifts_of(box)}
    head = ("gear", *box.elements, "ratio", "published", "difference")
    return [
        html.H3(box.name),
        hint(box.source),
        table(head, application, "Application table: ● is engaged.", "application"),
        html.H3("Reduction of a shift"),
        row(choice("gearbox-shift", "Shift", shifts, next(iter(shifts)))),
        html.Div(id="reduction"),
        html.H3("Members"),
        *([table(("set", "sun", "ring", "carrier", "z"), sets, "Planetary sets.")] if sets else []),
        table(("member", "inertia [kg·m²]", "joined by"), members),
    ]


def _reduction(found: ReducedShift) -> list[Component]:
    one = found.reduction
    elements: list[list[Content]] = [
        [each.element, role, *(_right(f"{x:.4f}") for x in (each.i_c, each.i_out, each.ratio))]
        for role, each in (("off-going", one.off_going), ("on-coming", one.on_coming))
    ]
    elements += [[name, "engaged throughout", "", "", ""] for name in one.common]
    members: list[list[Content]] = [
        [
            each.member,
            _right(f"{each.inertia:.4g}"),
            *(_right(_number(value)) for value in (each.a, each.b, each.coupling)),
        ]
        for each in one.members
    ]
    mass: list[list[Content]] = [
        ["ω_in", _right(_number(one.M11)), _right(_number(one.M12))],
        ["ω_out", _right(_number(one.M12)), _right(_number(one.M22))],
    ]
    return [
        hint(one.condition()),
        table(("element", "", "i_c", "i_out", "i_c·i_out"), elements,
              "slip = ω_in/i_c − i_out·ω_out (eq. 15)"),
        table(("mass matrix [kg·m²]", "ω_in", "ω_out"), mass),
        table(("member", "inertia [kg·m²]", "a", "b", "to M12"), members,
              "Members that move: ω = a·ω_in − b·ω_out."),
        _error(found),
    ]  # fmt: skip


def _error(found: ReducedShift) -> Component:
    if found.reduction.exact:
        return hint("Nothing couples the two shafts: the reduced form makes no error.")
    if found.estimated is None or found.simulated is None:
        return hint(f"The error of leaving M12 out is not told: {found.reason}")
    rows: list[list[Content]] = [
        [
            label,
            *(
                _right(f"{significant(getattr(each, name) * unit.factor, 3)} {unit.label}")
                for each in (found.estimated, found.simulated)
            ),
        ]
        for label, name, unit in (
            ("shaft torque", "shaft_torque", NM),
            ("input speed", "input_speed", RPM),
            ("output speed", "output_speed", RPM),
        )
    ]
    caption = "Largest error over the reference shift of the card without M12."
    return table(("signal", "estimated", "simulated"), rows, caption)


def _number(value: float) -> str:
    """Format a number to four digits; round-off relative to 1 becomes zero."""
    return "0" if abs(value) < _ROUND_OFF else f"{value:.4g}"


def _right(text: str) -> Component:
    return html.Div(text, className="number")
