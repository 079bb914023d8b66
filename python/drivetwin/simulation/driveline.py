# SPDX-License-Identifier: MIT
"""Driveline of a vehicle as elements of a network, and the state in which its run starts.

    engine - (input shaft or converter) - gearbox - output shaft - final drive - (tyre) - vehicle

Numbers may be variables; the elements then carry their derivatives.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from drivetwin.errors import InputError
from drivetwin.simulation.added_elements import (
    LEAST_SPEED,
    NO_ADDED_ELEMENTS,
    AddedElements,
    InputShaft,
    OpenConverter,
)
from drivetwin.simulation.dual_clutch import (
    ENGINE_TORQUE,
    DualClutch,
    FrictionTable,
    RoadLoad,
    ShiftElement,
    Signal,
    State,
    Stribeck,
)
from drivetwin.simulation.element_schema import list_ports
from drivetwin.simulation.network import Element, Output, Start, build_element
from drivetwin.simulation.variable import sign

CRANK, ENGINE, INPUT, OUTPUT, AXLE, WHEEL, VEHICLE = (
    *("crankshaft", "engine", "input gear", "output", "axle", "wheel", "vehicle"),
)
"""Nodes. ENGINE is the gearbox side of an input shaft or converter, CRANK its engine side."""
SHAFT, INPUT_SHAFT, CONVERTER = "output shaft", "input shaft", "converter"
LOAD, WALK = "load", "load walk"


@dataclass(frozen=True)
class OutputSide:
    """Shaft, final drive, vehicle and load behind a gearbox; fields as in `DualClutch`."""

    k_o: float
    c_o: float
    i_f: float
    J_v: float
    load: RoadLoad

    @classmethod
    def from_model(cls, model: DualClutch) -> OutputSide:
        """Select the output side of a model."""
        return cls(model.k_o, model.c_o, model.i_f, model.J_v, model.load)


@dataclass(frozen=True, eq=False)
class Driveline:
    """Dual clutch with the elements beside it."""

    model: DualClutch
    added: AddedElements = NO_ADDED_ELEMENTS

    def share_form(self, other: AddedElements) -> Driveline:
        """Return the driveline with its added elements in the form of those of `other`."""
        return Driveline(self.model, self.added.share_form(other))


@dataclass(frozen=True)
class VehicleBody:
    """Inertia that moves with the vehicle [kg m^2], path of the number, torque that drives it.

    The torque at the inertia [N m] is `factor` times the output `drive`.
    """

    inertia: float
    path: str
    drive: Output
    factor: float


def find_body(driveline: Driveline) -> VehicleBody:
    """Find the inertia that moves with the vehicle: behind the tyre where there is one."""
    model, tyre = driveline.model, driveline.added.tyre
    if tyre is None:
        return VehicleBody(model.J_v, "J_v.inertia", ("shaft_torque", SHAFT), model.i_f)
    inertia = model.J_v - tyre.rim_inertia
    return VehicleBody(inertia, "vehicle.inertia", ("torque", "tyre.b"), 1.0)


def build_clutch(
    name: str,
    nodes: tuple[str, str],
    friction: Stribeck | FrictionTable,
    gain: float = 1.0,
    P0: float = 0.0,
    peak: float = 1.0,
    drum_inertia: float = 0.0,
) -> Element:
    """Build a clutch between two nodes with a pressure input [Pa] of its own name.

    Its numbers are as in `ShiftElement`; unit friction and gain make the input a capacity [N m].
    """
    (a, b), law = nodes, dict(vars(friction))
    fields = {"friction": law, "gain": gain, "p0": P0, "peak": peak, "pressure": name}
    return build_element("clutch", name, a=a, b=b, **fields, drum_inertia=drum_inertia)


def build_driveline(model: DualClutch, added: AddedElements = NO_ADDED_ELEMENTS) -> list[Element]:
    """Build the elements of a dual clutch with added elements.

    Inputs are `ENGINE_TORQUE` [N m], the pressures [Pa] by shift element, and `WALK` [N m] where
    the load has one.
    """
    loss = {"law": model.loss_law, "eta": model.eta}
    return [
        *build_engine_side(model.J1, added),
        build_element("gear", "i_in", a=ENGINE, b=INPUT, ratio=model.i_in, loss=loss),
        build_element("inertia", "J2e", node=INPUT, inertia=model.J2e * model.i_in * model.i_in),
        build_element("inertia", "J_out", node=OUTPUT, inertia=model.J_out),
        *build_shaft(OutputSide.from_model(model), OUTPUT, added),
        *(one for each in model.elements for one in _build_path(each, model, added)),
        *build_vehicle(OutputSide.from_model(model), added),
    ]


def build_engine_side(
    J1: float, added: AddedElements = NO_ADDED_ELEMENTS, node: str = ENGINE
) -> list[Element]:
    """Build the inertia J1 [kg m^2] with the engine torque, and the elements before the gearbox.

    `node` is the one on which J1 turns.
    """
    front, gearbox, inertia = added.front, node, J1
    elements = []
    if isinstance(front, InputShaft):
        node, inertia = CRANK, J1 - front.inertia
        fields = {"stiffness": front.stiffness, "damping": front.damping}
        elements = [
            build_element("inertia", "engine inertia", node=CRANK, inertia=front.inertia),
            build_element("spring_damper", INPUT_SHAFT, a=CRANK, b=gearbox, **fields),
        ]
    elif isinstance(front, OpenConverter):
        node, ends = CRANK, {"pump": CRANK, "turbine": gearbox}
        elements = [
            build_element("inertia", "engine inertia", node=CRANK, inertia=front.engine_inertia),
            build_element("torque_converter", CONVERTER, **ends, map=asdict(front.converter)),
        ]
    return [
        build_element("inertia", "J1", node=gearbox, inertia=inertia),
        build_element("torque", "engine", node=node, input=ENGINE_TORQUE),
        *elements,
        *_build_drag("input drag", gearbox, added.input_drag),
    ]


def get_side_nodes(name: str) -> tuple[str, str]:
    """Return the nodes on both sides of a shift element."""
    return f"{name} input side", f"{name} output side"


def _build_path(element: ShiftElement, model: DualClutch, added: AddedElements) -> list[Element]:
    """Build a shift element between its two ratios (eq. 15)."""
    name, (driving, driven) = element.name, get_side_nodes(element.name)
    fields: dict[str, Any] = {}
    if name in added.efficiency:
        fields = {"loss": {"law": model.loss_law, "eta": added.efficiency[name]}}
    return [
        build_element("gear", f"i_c {name}", a=INPUT, b=driving, ratio=element.i_c, **fields),
        build_clutch(
            name,
            (driving, driven),
            element.friction,
            element.gain,
            element.P0,
            element.peak,
            element.drum_inertia,
        ),
        build_element("gear", f"i_out {name}", a=driven, b=OUTPUT, ratio=element.i_out),
    ]


def build_shaft(
    side: OutputSide, output: str, added: AddedElements = NO_ADDED_ELEMENTS
) -> list[Element]:
    """Build the output shaft behind the node `output`, the final drive and the wheel."""
    fields: dict[str, Any] = {"a": output, "b": AXLE, "damping": side.c_o}
    table = added.shaft_table
    if table is not None:
        curve = {"twist": list(table.twist), "torque": list(table.torque)}
        shaft = build_element("spring_table", SHAFT, **fields, **curve)
    elif added.gap > 0.0:
        shaft = build_element("backlash", SHAFT, **fields, stiffness=side.k_o, gap=added.gap)
    else:
        shaft = build_element("spring_damper", SHAFT, **fields, stiffness=side.k_o)
    tyre = added.tyre
    inertia = side.J_v if tyre is None else tyre.rim_inertia
    massless = tyre is not None and tyre.speed is not None and tyre.rim_inertia == 0.0
    return [
        shaft,
        build_element("gear", "i_f", a=AXLE, b=WHEEL, ratio=side.i_f),
        *([] if massless else [build_element("inertia", "J_v", node=WHEEL, inertia=inertia)]),
        *_build_drag("brake drag", WHEEL, added.brake_drag),
    ]


def build_vehicle(side: OutputSide, added: AddedElements = NO_ADDED_ELEMENTS) -> list[Element]:
    """Build the load at the wheel, or the vehicle with its load behind a tyre."""
    body, tyre = WHEEL, added.tyre
    elements = []
    if tyre is not None:
        body, inertia = VEHICLE, side.J_v - tyre.rim_inertia
        fields = {"slip_stiffness": tyre.slip_stiffness, "least_speed": LEAST_SPEED}
        if tyre.speed is not None:
            fields = {"stiffness": 0.0, "damping": tyre.slip_stiffness / tyre.speed}
        kind = "tyre" if tyre.speed is None else "spring_damper"
        elements = [
            build_element(kind, "tyre", a=WHEEL, b=VEHICLE, **fields),
            build_element("inertia", "vehicle", node=VEHICLE, inertia=inertia),
        ]
    elements.append(build_element("road_load", LOAD, node=body, **vars(side.load)))
    if added.walk is not None:
        elements.append(build_element("torque", WALK, node=body, input=WALK))
    return elements


def require_own_nodes(gearing: Sequence[Element]) -> None:
    """Raise InputError where a gearbox has a node that belongs to the vehicle around it."""
    used = {node for element in gearing for node in list_ports(element).values()}
    taken = [node for node in (CRANK, AXLE, WHEEL, VEHICLE) if node in used]
    if taken:
        raise InputError(
            f"{', '.join(map(repr, taken))}: a member of the gearbox has the name of a node of the "
            "vehicle",
            "rename the member on the gearbox card",
        )


def _build_drag(name: str, node: str, torque: float) -> Sequence[Element]:
    """Build a Coulomb torque [N m] between a node and the ground; nothing without torque."""
    if torque == 0.0:
        return []
    table = {"speed": [0.0, 1.0], "torque": [torque, torque], "peak": 1.0}
    return [build_element("bearing", name, a=node, b="ground", **table)]


_STALL = 0.05
"""Least speed ratio looked at for the steady state of a converter."""


def settle(
    model: DualClutch, added: AddedElements, start: State, engine_torque: Signal, time: float
) -> State:
    """Return a start with the twist of the output shaft that quasi-steady acceleration has.

    `engine_torque` is the acting one, `time` [s] the instant of the start. The twist is without
    the play of the shaft.
    """
    torque, _ = _solve_acceleration(model, added, start, _interpolate(engine_torque, time))
    return replace(start, twist=compute_twist(model, added, torque))


def compute_twist(model: DualClutch, added: AddedElements, torque: float) -> float:
    """Compute the twist [rad] at which the output shaft has `torque` [N m], without its play."""
    table = added.shaft_table
    if table is None:
        return torque / model.k_o
    return float(np.interp(torque, table.torque, table.twist))


def build_start(
    model: DualClutch, added: AddedElements, start: State, engine_torque: Signal, time: float
) -> Start:
    """Build the start of the network: speeds and twist of `start`, the rest quasi-steady.

    The twist of `start` is the one that makes torque: half of the play is added. `engine_torque` is
    the acting one, `time` [s] the instant of the start.
    """
    speeds = {ENGINE: start.engine_speed, OUTPUT: start.output_speed, WHEEL: start.wheel_speed}
    twists = {SHAFT: start.twist + 0.5 * added.gap * sign(start.twist)}
    front, tyre = added.front, added.tyre
    if front is None and tyre is None:
        return Start(speeds, twists, start.locked)
    drive = _interpolate(engine_torque, time)
    if isinstance(front, OpenConverter):
        speeds[CRANK] = solve_steady_speed(front, drive, start.engine_speed)
        return Start(speeds, twists, start.locked)
    torque, rate = _solve_acceleration(model, added, start, drive)
    if isinstance(front, InputShaft):
        speeds[CRANK] = start.engine_speed
        ratio = model.get_overall_ratio(start.locked[0]) * model.i_f
        twists[INPUT_SHAFT] = (drive - front.inertia * (ratio * rate)) / front.stiffness
    if tyre is not None:
        wheel = start.wheel_speed
        braking = added.brake_drag * sign(wheel)
        passed = model.i_f * torque - braking - tyre.rim_inertia * rate
        slip = passed / tyre.slip_stiffness
        exact = wheel / (1.0 + slip * sign(wheel))
        speeds[VEHICLE] = exact if tyre.speed is None else wheel - slip * tyre.speed
    return Start(speeds, twists, start.locked)


def solve_steady_speed(front: OpenConverter, torque: float, turbine: float) -> float:
    """Return the speed of the engine [rad/s] that gives `torque` [N m] steadily.

    `turbine` is the speed of the turbine [rad/s].
    """
    from scipy.optimize import brentq

    def surplus(ratio: float) -> float:
        return float(front.converter.compute_pump_torque(turbine / ratio, turbine)) - torque

    return turbine / float(brentq(surplus, _STALL, 1.0))


def _interpolate(engine_torque: Signal, time: float) -> float:
    """Interpolate the torque at the start, without a derivative by its delay: the engine turns
    evenly there."""
    acting = time - float(engine_torque.delay)
    return float(np.interp(acting, engine_torque.time, engine_torque.values))


def _solve_acceleration(
    model: DualClutch, added: AddedElements, start: State, engine_torque: float
) -> tuple[float, float]:
    """Return the torque of the output shaft [N m] and the acceleration of the wheel [rad/s²].

    All bodies accelerate alike in the gear that `start` holds. The drums of open elements are left
    out, as in `DualClutch.compute_steady_torque`.
    """
    wheel, (gear, *_) = start.wheel_speed, start.locked
    walk = 0.0 if added.walk is None else float(added.walk.values[0])
    constant = model.load.constant + walk + added.brake_drag * sign(wheel)
    loaded = replace(model, load=replace(model.load, constant=constant))
    ratio = model.get_overall_ratio(gear)
    torque = loaded.compute_steady_torque(engine_torque - added.input_drag, ratio, wheel)
    return torque, (model.i_f * torque - loaded.load.evaluate(wheel)) / model.J_v
