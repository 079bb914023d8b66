# SPDX-License-Identifier: MIT
"""Friction and gears with losses: clutch, brake, one-way clutch, bearing of the Standard Library.

The torque of a friction element is cgeo · mu(|w_rel|) · fn_max · f_normalized, at rest up to `peak`
times that at zero slip: our law with cgeo = gain and fn_max · f_normalized = max(0, P - P0), in
numbers of SI.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from drivetwin.errors import InputError
from drivetwin.export.modelica.component import (
    DRAG,
    LOSS_GEAR,
    LOSS_PLANETARY,
    ROTATIONAL,
    SLIP_INERTIA,
    Component,
    Flanges,
    Names,
    Part,
    format_matrix,
    format_values,
)
from drivetwin.export.parameters.content import format_number
from drivetwin.simulation.dual_clutch import Stribeck
from drivetwin.simulation.element_schema import GROUND
from drivetwin.simulation.network import Element


def build_loss_gear(element: Element, names: Names) -> Part:
    """Build a gear with a table of losses. Raises InputError if it has a loss law beside it."""
    if element.get("loss") is not None:
        raise InputError(
            f"{element['name']}: a gear with both 'loss' and 'losses' has no Modelica translation",
            "export it with one of them, or put the table on a gear of ratio 1 beside it",
        )
    modifiers = (*format_values(ratio=element["ratio"]), _format_losses(element["losses"]))
    flanges = (("flange_a", element["a"]), ("flange_b", element["b"]))
    gear = Component(LOSS_GEAR, names.elements[element["name"]], modifiers, flanges)
    return Part((gear,), helpers=frozenset({LOSS_GEAR}))


def add_planetary_losses(part: Part, losses: Mapping[str, Any] | None) -> Part:
    """Put a table of losses on the planetary set that a part begins with."""
    if losses is None:
        return part
    gears, *others = part.components
    modifiers = (*gears.modifiers, _format_losses(losses))
    lossy = replace(gears, type=LOSS_PLANETARY, modifiers=modifiers)
    return replace(part, components=(lossy, *others), helpers=frozenset({LOSS_PLANETARY}))


def add_drag(part: Part, element: Element, names: Names) -> Part:
    """Put the drag of a clutch beside it."""
    table = element.get("drag")
    if table is None:
        return part
    rows = [(0.0, 0.0), *zip(table["slip"], table["torque"], strict=True)]
    flanges = (("flange_a", element["a"]), ("flange_b", element["b"]))
    name = f"{names.elements[element['name']]}_drag"
    drag = Component(DRAG, name, (("drag", format_matrix(rows)),), flanges)
    return replace(part, components=(*part.components, drag), helpers=part.helpers | {DRAG})


def _format_losses(losses: Mapping[str, Any]) -> tuple[str, str]:
    """Format the table from standstill on, over torques of both signs."""
    rows = [
        (float(t), 0.0, *loss) for t, loss in zip(losses["torque"], losses["loss"], strict=True)
    ]
    if rows[0][0] >= 0.0:
        mirrored = [(-torque, *loss) for torque, *loss in reversed(rows) if torque > 0.0]
        rows = [*mirrored, *rows]
    return "losses", format_matrix([(0.0, 0.0, *losses["speed"]), *rows])


_FULL_PRESSURE = 1e6
"""Pressure above the fill [Pa] that counts as f_normalized = 1; the product alone matters."""
_POINTS, _DECAYS, _TAIL = 101, 10.0, 40.0
"""Points of the table of a Stribeck law up to so many times its slip v_s, and one far out on what
is a straight line then: the table keeps within 1e-4 of μ and goes on along its last piece."""


def build_clutch(element: Element, names: Names) -> Part:
    """A clutch, or a brake where `b` is the ground; its drum as an inertia on the slip."""
    name = names.elements[element["name"]]
    both: Flanges = (("flange_a", element["a"]), ("flange_b", element["b"]))
    if element["b"] == GROUND:
        kind, flanges, rest = "Brake", both[:1], f"{name}.w"
    else:
        kind, flanges, rest = "Clutch", both, f"{name}.w_rel"
    part = replace(
        _build_friction_component(f"{ROTATIONAL}.Components.{kind}", element, flanges, names),
        rest=rest,
    )
    part = add_drag(part, element, names)
    drum = element.get("drum_inertia", 0.0)
    if drum == 0.0:
        return part
    inertia = Component(SLIP_INERTIA, f"{name}_drum", format_values(J=drum), both)
    helpers = part.helpers | {SLIP_INERTIA}
    return replace(part, components=(*part.components, inertia), helpers=helpers)


def build_one_way_clutch(element: Element, names: Names) -> Part:
    """A freewheel with the clutch beside it; without one, the normal force is zero."""
    name = names.elements[element["name"]]
    kind = f"{ROTATIONAL}.Components.OneWayClutch"
    flanges = (("flange_a", element["a"]), ("flange_b", element["b"]))
    beside = element.get("clutch")
    if beside is None:
        free = Component(kind, name, format_values(fn_max=1.0), flanges)
        return Part((free,), (f"{name}.f_normalized = 0;",), rest=f"{name}.w_rel")
    part = _build_friction_component(kind, {**beside, "name": element["name"]}, flanges, names)
    return replace(part, rest=f"{name}.w_rel")


def build_bearing(element: Element, names: Names) -> Part:
    """Bearing friction, against the housing or another shaft."""
    name, b = names.elements[element["name"]], element["b"]
    rows = zip(element["speed"], element["torque"], strict=True)
    modifiers = (("tau_pos", format_matrix(rows)), *format_values(peak=element["peak"]))
    flanges: Flanges = (("flange_a", element["a"]),)
    if b != GROUND:
        modifiers, flanges = (*modifiers, ("useSupport", "true")), (*flanges, ("support", b))
    kind = f"{ROTATIONAL}.Components.BearingFriction"
    return Part((Component(kind, name, modifiers, flanges),), rest=f"{name}.w")


def _build_friction_component(kind: str, element: Element, flanges: Flanges, names: Names) -> Part:
    name = names.elements[element["name"]]
    modifiers = (
        ("mu_pos", format_matrix(build_friction_rows(element["friction"]))),
        *format_values(peak=element["peak"], cgeo=element["gain"], fn_max=_FULL_PRESSURE),
    )
    pressure = names.get_acting(element["pressure"])
    fill = f"P0_{name}"
    return Part(
        (Component(kind, name, modifiers, flanges),),
        (f"{name}.f_normalized = max(0, {pressure} - {fill})/{name}.fn_max;",),
        (
            f"  parameter Modelica.Units.SI.Pressure {fill}={format_number(element['p0'])}"
            f' "Pressure at which the fill of {name} ends";',
        ),
    )


def build_friction_rows(law: Mapping[str, Any]) -> list[tuple[float, float]]:
    """Slip [rad/s] and μ as a table that goes on along its last piece."""
    if "slip" in law:
        rows = [(float(s), float(m)) for s, m in zip(law["slip"], law["mu"], strict=True)]
        if law.get("extend") or len(rows) == 1:
            return rows
        return [*rows, (2.0 * rows[-1][0] + 1.0, rows[-1][1])]
    stribeck = Stribeck(**law)
    bend = _DECAYS * stribeck.v_s * np.linspace(0.0, 1.0, _POINTS) ** 2
    slip = np.append(bend, _TAIL * stribeck.v_s)
    return list(zip(slip.tolist(), stribeck.evaluate(slip).tolist(), strict=True))
