# SPDX-License-Identifier: MIT
"""Elements as components of the Standard Library, with and without friction states."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from drivetwin.errors import InputError
from drivetwin.export.modelica.inputs import (
    CONVERTER,
    DRAG,
    LOSS_GEAR,
    LOSS_PLANETARY,
    PAPER_GEAR,
    ROTATIONAL,
    SLIP_INERTIA,
    SPRING_TABLE,
    TYRE,
    VISCOUS,
    Component,
    Flanges,
    Modifiers,
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


_COMPONENTS = f"{ROTATIONAL}.Components"
_SOURCES = f"{ROTATIONAL}.Sources"
_HOLD = ("extrapolation", "Modelica.Blocks.Types.Extrapolation.HoldLastPoint")


def build_part(element: Element, names: Names) -> Part:
    """Declarations and equations of one element. Raises InputError for an unknown type."""
    try:
        translate = _TRANSLATIONS[element["type"]]
    except KeyError:
        raise InputError(
            f"elements of type {element['type']!r} have no Modelica translation",
            f"use {', '.join(_TRANSLATIONS)}",
        ) from None
    return translate(element, names)


def _build_inertia(element: Element, names: Names) -> Part:
    name = names.elements[element["name"]]
    flange = (("flange_a", element["node"]),)
    inertia = format_values(J=element["inertia"])
    return Part((Component(f"{_COMPONENTS}.Inertia", name, inertia, flange),))


def _build_gear(element: Element, names: Names) -> Part:
    if element.get("losses") is not None:
        return build_loss_gear(element, names)
    name = names.elements[element["name"]]
    flanges = (("flange_a", element["a"]), ("flange_b", element["b"]))
    ratio, loss = format_values(ratio=element["ratio"]), element.get("loss")
    if loss is None:
        return Part((Component(f"{_COMPONENTS}.IdealGear", name, ratio, flanges),))
    if loss["law"] == "paper":
        modifiers = (*ratio, *format_values(eta=loss["eta"]))
        gear = Component(PAPER_GEAR, name, modifiers, flanges)
        return Part((gear,), helpers=frozenset({PAPER_GEAR}))
    drag = loss.get("drag", 0.0)
    row = (0.0, loss["eta"], loss.get("eta_backward", loss["eta"]), drag)
    table = format_matrix([(*row, loss.get("drag_backward", drag))])
    lossy = Component(f"{_COMPONENTS}.LossyGear", name, (*ratio, ("lossTable", table)), flanges)
    return Part((lossy,))


def _build_planetary(element: Element, names: Names) -> Part:
    """The set; the planets, which spin behind a set of their own, z' = (z - 1)/2, as an inertia."""
    name, z = names.elements[element["name"]], element["z"]
    shafts = (("sun", element["sun"]), ("carrier", element["carrier"]))
    kind = f"{_COMPONENTS}.IdealPlanetary"
    gears = Component(kind, name, format_values(ratio=z), (*shafts, ("ring", element["ring"])))
    spin = element.get("planet_inertia", 0.0)
    if spin == 0.0:
        return add_planetary_losses(Part((gears,)), element.get("losses"))
    planet = f"{name} planets"
    pinions = Component(
        kind, f"{name}_pinions", format_values(ratio=(z - 1.0) / 2.0), (*shafts, ("ring", planet))
    )
    mass = Component(
        f"{_COMPONENTS}.Inertia", f"{name}_planets", format_values(J=spin), (("flange_a", planet),)
    )
    return add_planetary_losses(Part((gears, pinions, mass)), element.get("losses"))


def _build_spring_damper(element: Element, names: Names) -> Part:
    modifiers = format_values(c=element["stiffness"], d=element["damping"])
    return _build_compliance(f"{_COMPONENTS}.SpringDamper", modifiers, element, names)


def _build_spring_table(element: Element, names: Names) -> Part:
    rows = format_matrix(list(zip(element["twist"], element["torque"], strict=True)))
    modifiers = (("characteristic", rows), *format_values(d=element["damping"]))
    part = _build_compliance(SPRING_TABLE, modifiers, element, names)
    return replace(part, helpers=frozenset({SPRING_TABLE}))


def _build_viscous_coupling(element: Element, names: Names) -> Part:
    points = list(zip(element["slip"], element["torque"], strict=True))
    backward = [(-slip, -torque) for slip, torque in reversed(points)]
    modifiers = (("characteristic", format_matrix([*backward, (0.0, 0.0), *points])),)
    part = _build_compliance(VISCOUS, modifiers, element, names)
    return replace(part, helpers=frozenset({VISCOUS}))


def _build_tyre(element: Element, names: Names) -> Part:
    modifiers = format_values(
        slip_stiffness=element["slip_stiffness"], w_least=element["least_speed"]
    )
    return replace(_build_compliance(TYRE, modifiers, element, names), helpers=frozenset({TYRE}))


def _build_backlash(element: Element, names: Names) -> Part:
    modifiers = format_values(c=element["stiffness"], d=element["damping"], b=element["gap"])
    return _build_compliance(f"{_COMPONENTS}.ElastoBacklash", modifiers, element, names)


def _build_compliance(kind: str, modifiers: Modifiers, element: Element, names: Names) -> Part:
    flanges = (("flange_a", element["a"]), ("flange_b", element["b"]))
    return Part((Component(kind, names.elements[element["name"]], modifiers, flanges),))


def _build_torque_converter(element: Element, names: Names) -> Part:
    table = element["map"]
    columns = (table["speed_ratio"], table["capacity"], table["torque_ratio"])
    rows = format_matrix(list(zip(*columns, strict=True)))
    flanges = (("flange_a", element["pump"]), ("flange_b", element["turbine"]))
    name = names.elements[element["name"]]
    return Part(
        (Component(CONVERTER, name, (("map", rows),), flanges),), helpers=frozenset({CONVERTER})
    )


def _build_road_load(element: Element, names: Names) -> Part:
    name = names.elements[element["name"]]
    flange = (("flange", element["node"]),)
    parts = []
    if element["constant"] != 0.0:
        torque = format_values(tau_constant=-element["constant"])
        parts.append(Component(f"{_SOURCES}.ConstantTorque", f"{name}_constant", torque, flange))
    if element["aero"] != 0.0:
        torque = (*format_values(tau_nominal=-element["aero"]), ("TorqueDirection", "false"))
        parts.append(
            Component(
                f"{_SOURCES}.QuadraticSpeedDependentTorque",
                f"{name}_aero",
                (*torque, *format_values(w_nominal=1.0)),
                flange,
            )
        )
    if element["rolling"] == 0.0:
        return Part(tuple(parts))
    table = {"name": element["name"], "a": element["node"], "b": "ground", "peak": 1.0}
    rolling = build_bearing({**table, "speed": [0.0], "torque": [element["rolling"]]}, names)
    return Part((*parts, *rolling.components), rest=rolling.rest)


def _build_torque(element: Element, names: Names) -> Part:
    name = names.elements[element["name"]]
    equation = (f"{name}.tau = {names.get_acting(element['input'])};",)
    reaction = element.get("reaction")
    if reaction is None or reaction == GROUND:
        flanges: Flanges = (("flange", element["node"]),)
        return Part((Component(f"{_SOURCES}.Torque", name, (), flanges),), equation)
    between = (("flange_b", element["node"]), ("flange_a", reaction))
    return Part((Component(f"{_SOURCES}.Torque2", name, (), between),), equation)


def _build_speed_source(element: Element, names: Names) -> Part:
    name = names.elements[element["name"]]
    flange = (("flange", element["node"]),)
    source = Component(f"{_SOURCES}.Speed", name, (("exact", "true"),), flange)
    return Part((source,), (f"{name}.w_ref = {names.get_acting(element['input'])};",))


def _build_engine_map(element: Element, names: Names) -> Part:
    name, table = names.elements[element["name"]], element["map"]
    head = [(0.0, *table["speed"])]
    rows = [(t, *torque) for t, torque in zip(table["throttle"], table["torque"], strict=True)]
    steady = Component(
        "Modelica.Blocks.Tables.CombiTable2Ds",
        f"{name}_map",
        (("table", format_matrix(head + rows)), _HOLD),
    )
    source = Component(f"{_SOURCES}.Torque", name, (), (("flange", element["node"]),))
    equations = [
        f"{name}_map.u1 = {names.get_acting(element['throttle'])};",
        f"{name}_map.u2 = der({name}.flange.phi);",
    ]
    if element.get("lag") is None:
        return Part((steady, source), (*equations, f"{name}.tau = {name}_map.y;"))
    start = ("initType", "Modelica.Blocks.Types.Init.InitialOutput")
    lag = Component(
        "Modelica.Blocks.Continuous.FirstOrder",
        f"{name}_lag",
        (*format_values(T=element["lag"], y_start=0.0), start),
    )
    equations += [f"{name}_lag.u = {name}_map.y;", f"{name}.tau = {name}_lag.y;"]
    return Part((steady, lag, source), tuple(equations))


_TRANSLATIONS = {
    "inertia": _build_inertia,
    "gear": _build_gear,
    "planetary": _build_planetary,
    "clutch": build_clutch,
    "one_way_clutch": build_one_way_clutch,
    "bearing": build_bearing,
    "viscous_coupling": _build_viscous_coupling,
    "spring_damper": _build_spring_damper,
    "spring_table": _build_spring_table,
    "backlash": _build_backlash,
    "tyre": _build_tyre,
    "torque_converter": _build_torque_converter,
    "road_load": _build_road_load,
    "torque": _build_torque,
    "prescribed_speed": _build_speed_source,
    "engine_map": _build_engine_map,
}
