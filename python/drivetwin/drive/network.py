# SPDX-License-Identifier: MIT
"""The whole driveline of the paper's Fig. 1 as elements of the core, and its standstill.

Engine map, torque converter with the lock-up clutch beside it, gearbox with the inertias of its
members, output shaft, final drive, vehicle with service brake. A gearbox with dogs starts by its
own clutch: the engine is at its input.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

from drivetwin.drive.powertrain import Powertrain
from drivetwin.gearbox import Drive, Gearbox, build_network_elements, solve_gear
from drivetwin.simulation.driveline import (
    CRANK,
    LOAD,
    SHAFT,
    WHEEL,
    build_clutch,
    build_shaft,
    build_vehicle,
    require_own_nodes,
)
from drivetwin.simulation.dual_clutch import FrictionTable
from drivetwin.simulation.network import Element, Output, Start, build_element

ENGINE, CONVERTER = "map", "converter"
LOCK_UP, BRAKE = "lock-up", "service brake"
"""Friction elements beside those of the gearbox; the inputs of their names are the pressure [Pa]
and the brake torque [N m]."""
PEDAL = "pedal"


def build_driveline_elements(gearbox: Gearbox, powertrain: Powertrain) -> list[Element]:
    """Return the elements; inputs are PEDAL, BRAKE, pressures [Pa] and capacities of dogs [N m].

    Raises CardError where the gearbox card has no [drive], InputError where it has a converter or
    freewheels.
    """
    drive = gearbox.require_drive()
    gearbox.require_pressed_alone("a drive")
    gearing = build_network_elements(gearbox)
    require_own_nodes(gearing)
    return [
        *_build_engine(powertrain, drive, get_crank(gearbox)),
        *([] if gearbox.dogs else _build_converter(powertrain, gearbox.input)),
        *gearing,
        *_build_vehicle(powertrain, drive, gearbox.output),
    ]


def get_crank(gearbox: Gearbox) -> str:
    """Return the node of the crankshaft: the gearbox input where the gearbox has dogs."""
    return gearbox.input if gearbox.dogs else CRANK


def _build_engine(powertrain: Powertrain, drive: Drive, crank: str) -> list[Element]:
    engine = powertrain.engine
    table = {"throttle": [0.0, 1.0], "speed": engine.speed, "torque": [engine.closed, engine.full]}
    return [
        build_element("inertia", "engine", node=crank, inertia=drive.engine_inertia),
        build_element("engine_map", ENGINE, node=crank, throttle=PEDAL, lag=engine.lag, map=table),
    ]


def _build_converter(powertrain: Powertrain, turbine: str) -> list[Element]:
    table, clutch = asdict(powertrain.converter), powertrain.lock_up
    return [
        build_element("torque_converter", CONVERTER, pump=CRANK, turbine=turbine, map=table),
        build_clutch(
            LOCK_UP, (CRANK, turbine), clutch.friction, clutch.gain, clutch.P0, clutch.peak
        ),
    ]


def _build_vehicle(powertrain: Powertrain, drive: Drive, output: str) -> list[Element]:
    side = drive.build_output_side(powertrain.road)
    # A disc brake by its torque: unit gain and friction make the input a capacity in N m.
    return [
        *build_shaft(side, output),
        *build_vehicle(side),
        build_clutch(BRAKE, (WHEEL, "ground"), FrictionTable((0.0,), (1.0,))),
    ]


def build_standstill(gearbox: Gearbox, gear: str, powertrain: Powertrain) -> Start:
    """Return the vehicle at rest in `gear`, the engine idling.

    With a converter the shaft is twisted by what the turbine pulls, else the drive would begin with
    a jerk. In a gearbox with dogs the starting clutch is open.
    """
    idle, statics = powertrain.engine.idle, solve_gear(gearbox, gear)
    speeds = dict.fromkeys(statics.speeds, 0.0) | {get_crank(gearbox): idle, WHEEL: 0.0}
    elements = gearbox.get_gear(gear).elements
    if gearbox.dogs:
        engaged = [name for name in elements if name in gearbox.dogs]
        return Start(speeds, {SHAFT: 0.0}, (*engaged, LOAD, BRAKE))
    pull = float(powertrain.converter.compute_turbine_torque(idle, 0.0)) * statics.ratio
    twists = {SHAFT: pull / gearbox.require_drive().shaft_stiffness}
    return Start(speeds, twists, (*elements, LOAD, BRAKE))


def list_friction_elements(gearbox: Gearbox) -> tuple[str, ...]:
    """Names of the lock-up clutch, where there is one, and the gearbox's shift elements."""
    return tuple(gearbox.elements) if gearbox.dogs else (LOCK_UP, *gearbox.elements)


def list_outputs(gearbox: Gearbox) -> Sequence[Output]:
    """List the outputs of a drive: speeds, torques, slips of all shift elements.

    The torques are those of engine, converter, shaft, road, service brake and shift elements.
    """
    nodes = dict.fromkeys((get_crank(gearbox), gearbox.input, gearbox.output, WHEEL))
    elements = list_friction_elements(gearbox)
    ports = () if gearbox.dogs else ("pump", "turbine")
    return [
        *(("speed", node) for node in nodes),
        ("shaft_torque", SHAFT),
        *(("slip", name) for name in elements),
        *(("friction_torque", name) for name in (*elements, BRAKE)),
        *(("torque", f"{CONVERTER}.{port}") for port in ports),
        *(("torque", f"{name}.node") for name in (ENGINE, LOAD)),
    ]


def list_energy_outputs(elements: Sequence[Element]) -> list[Output]:
    """List what closes the energy balance: works of engine and road, heats, stored energies."""
    outputs: list[Output] = []
    for element in elements:
        kind, name = element["type"], str(element["name"])
        if kind in ("engine_map", "road_load"):
            outputs.append(("work", name))
        elif kind != "inertia":
            outputs.append(("heat", name))
        if kind in ("inertia", "planetary", "clutch", "spring_damper"):
            outputs.append(("energy", name))
    return outputs
