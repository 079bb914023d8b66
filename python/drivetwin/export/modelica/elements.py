# SPDX-License-Identifier: MIT
"""Elements without friction states as components of the Standard Library."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.errors import InputError
from drivetwin.export.modelica.component import (
    CONVERTER,
    PAPER_GEAR,
    ROTATIONAL,
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
from drivetwin.export.modelica.friction import (
    add_planetary_losses,
    build_bearing,
    build_clutch,
    build_loss_gear,
    build_one_way_clutch,
)
from drivetwin.simulation.element_schema import GROUND
from drivetwin.simulation.network import Element

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
