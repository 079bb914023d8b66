# SPDX-License-Identifier: MIT
"""The whole driveline of the paper's Fig. 1 as elements of the core, and its standstill.

Engine map, torque converter with the lock-up clutch beside it, gearbox with the inertias of its
members, output shaft, final drive, vehicle with service brake.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict

from drivetwin.drive.powertrain import Powertrain
from drivetwin.errors import InputError
from drivetwin.gearbox import Drive, Gearbox, build_network_elements, solve_gear
from drivetwin.gearbox.spec import ElementKind
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
    """Return the elements; inputs are PEDAL, BRAKE and the pressures by element.

    Raises CardError where the gearbox card has no [drive], InputError where it has dogs, which
    cannot launch or shift under power, a converter or freewheels.
    """
    drive = gearbox.require_drive()
    gearbox.require_pressed_alone("a drive")
    dogs = [e.name for e in gearbox.elements.values() if e.kind is ElementKind.DOG]
    if dogs:
        raise InputError(
            f"{gearbox.name} shifts with dogs ({', '.join(dogs)})",
            "choose a gearbox whose gears are made by clutches and brakes alone",
        )
    gearing = build_network_elements(gearbox)
    require_own_nodes(gearing)
    return [
        *_build_engine(powertrain, drive),
        *_build_converter(powertrain, gearbox.input),
        *gearing,
        *_build_vehicle(powertrain, drive, gearbox.output),
    ]


def _build_engine(powertrain: Powertrain, drive: Drive) -> list[Element]:
    engine = powertrain.engine
    table = {"throttle": [0.0, 1.0], "speed": engine.speed, "torque": [engine.closed, engine.full]}
    return [
        build_element("inertia", "engine", node=CRANK, inertia=drive.engine_inertia),
        build_element("engine_map", ENGINE, node=CRANK, throttle=PEDAL, lag=engine.lag, map=table),
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
    """Return the vehicle at rest in `gear`, the engine idling against the converter.

    The shaft is twisted by what the turbine pulls, else the drive would begin with a jerk.
    """
    idle, statics = powertrain.engine.idle, solve_gear(gearbox, gear)
    members: Mapping[str, float | None] = statics.speeds
    speeds = dict.fromkeys(members, 0.0)
    locked = (*gearbox.get_gear(gear).elements, LOAD, BRAKE)
    pull = float(powertrain.converter.compute_turbine_torque(idle, 0.0)) * statics.ratio
    twists = {SHAFT: pull / gearbox.require_drive().shaft_stiffness}
    return Start(speeds | {CRANK: idle, WHEEL: 0.0}, twists, locked)


def list_friction_elements(gearbox: Gearbox) -> tuple[str, ...]:
    """Names of the lock-up clutch and the gearbox's shift elements."""
    return (LOCK_UP, *gearbox.elements)


def list_outputs(gearbox: Gearbox) -> Sequence[Output]:
    """List the outputs of a drive: speeds, torques, slips of all shift elements.

    The torques are those of engine, converter, shaft, road, service brake and shift elements.
    """
    nodes = (CRANK, gearbox.input, gearbox.output, WHEEL)
    elements = list_friction_elements(gearbox)
    return [
        *(("speed", node) for node in nodes),
        ("shaft_torque", SHAFT),
        *(("slip", name) for name in elements),
        *(("friction_torque", name) for name in (*elements, BRAKE)),
        *(("torque", f"{CONVERTER}.{port}") for port in ("pump", "turbine")),
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
