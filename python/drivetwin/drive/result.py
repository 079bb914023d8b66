# SPDX-License-Identifier: MIT
"""Results of a drive as a network: motion, converter, and the friction work of every shift."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from drivetwin.drive.plan import Schedule
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
from drivetwin.simulation.dual_clutch import EnergyAudit, Event, FloatArray, FrictionTable
from drivetwin.simulation.network import Element, NetworkRun, Output, Start, build_element

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


TRACE_STEP = 10
"""Instants of a drive per row of its traces."""
_OF_MASS = (0.75, 1.5)
"""Inertia of a vehicle over that of its mass: wheels and axles add to it, few numbers are exact."""


@dataclass(frozen=True)
class Action:
    """A shift, or a move of lock-up clutch, starting clutch or dogs, from `start` to `end` [s].

    `kind` is one of the four kinds of shift, else the device. An element is None where there is
    none of its side.
    """

    label: str
    kind: str
    start: float
    end: float
    off_going: str | None
    on_coming: str | None

    @property
    def elements(self) -> tuple[str, ...]:
        """The elements that change."""
        named = (self.off_going, self.on_coming)
        return tuple(dict.fromkeys(name for name in named if name is not None))


@dataclass(frozen=True)
class ElementWork:
    """Friction work of one element in one manoeuvre: `work` [J], `peak_power` [W]."""

    element: str
    work: float
    peak_power: float


@dataclass(frozen=True)
class Maneuver:
    """Events and shaft torque of an action.

    Times [s] at which the off-going element broke away and the on-coming one locked for good; None
    if that did not happen. Lowest and highest torque of the output shaft meanwhile [N m].
    """

    action: Action
    break_away: float | None
    lock: float | None
    shaft_torque: tuple[float, float]
    work: tuple[ElementWork, ...]


@dataclass(frozen=True, eq=False)
class ConverterTraces:
    """A converter over a drive; arrays (n,).

    `pump_torque` is taken from the engine, `turbine_torque` given to the gearbox [N m].
    """

    pump_torque: FloatArray
    turbine_torque: FloatArray
    speed_ratio: FloatArray
    torque_ratio: FloatArray


@dataclass(frozen=True, eq=False)
class DriveRun:
    """A drive; arrays (n,) on `time` [s], SI.

    `engine_torque` is that of the lagging map, `brake_torque` that of the service brake,
    `road_torque` that of the road on the wheel. `shaft_speed` goes by member behind a starting
    clutch; `converter` is None where there is none. `slip` and `torque` go by element, `pressure`
    by clutch and brake. `work` is the friction work of each
    element over the whole drive [J]. `energy` has works of engine and road, heats and stored
    energies of all other elements [J] on every `TRACE_STEP`th instant: `energy["heat", "shaft"]`.
    `warnings` name elements that slip outside their shifts, and different vehicle inertias of
    gearbox card and powertrain.
    """

    time: FloatArray
    engine_speed: FloatArray
    input_speed: FloatArray
    output_speed: FloatArray
    wheel_speed: FloatArray
    engine_torque: FloatArray
    shaft_torque: FloatArray
    pedal: FloatArray
    brake_torque: FloatArray
    road_torque: FloatArray
    shaft_speed: Mapping[str, FloatArray]
    converter: ConverterTraces | None
    slip: Mapping[str, FloatArray]
    torque: Mapping[str, FloatArray]
    pressure: Mapping[str, FloatArray]
    maneuvers: tuple[Maneuver, ...]
    work: Mapping[str, float]
    energy: Mapping[Output, FloatArray]
    events: tuple[Event, ...]
    audit: EnergyAudit
    warnings: tuple[str, ...]


def build_drive_run(
    gearbox: Gearbox,
    powertrain: Powertrain,
    schedule: Schedule,
    actions: Sequence[Action],
    motion: NetworkRun,
    energy: Mapping[Output, FloatArray],
) -> DriveRun:
    """Make a drive of its motion, which has been audited, its energies and what was decided."""
    time, columns, audit = motion.time, motion.columns, motion.audit
    if audit is None:
        raise ValueError("the motion has not been audited")
    crank, turbine = columns["speed", get_crank(gearbox)], columns["speed", gearbox.input]
    elements = list_friction_elements(gearbox)
    slip = {name: columns["slip", name] for name in elements}
    torque = {name: columns["friction_torque", name] for name in elements}
    power = {name: slip[name] * torque[name] for name in elements}
    shaft_torque = columns["shaft_torque", SHAFT]
    return DriveRun(
        time=time,
        engine_speed=crank,
        input_speed=turbine,
        output_speed=columns["speed", gearbox.output],
        wheel_speed=columns["speed", WHEEL],
        engine_torque=columns["torque", f"{ENGINE}.node"],
        shaft_torque=shaft_torque,
        pedal=schedule.evaluate(PEDAL, time),
        brake_torque=columns["friction_torque", BRAKE],
        road_torque=columns["torque", f"{LOAD}.node"],
        shaft_speed=_compute_shaft_speeds(gearbox, crank, slip),
        converter=_build_converter_traces(gearbox, powertrain, motion),
        slip=slip,
        torque=torque,
        pressure={
            name: schedule.evaluate(name, time) for name in elements if name not in gearbox.dogs
        },
        maneuvers=tuple(_build_maneuver(each, motion, power) for each in actions),
        work={name: float(np.trapezoid(power[name], time)) for name in elements},
        energy=energy,
        events=motion.events,
        audit=audit,
        warnings=(
            *_warn_vehicle_mismatch(gearbox, powertrain),
            *_warn_unwanted_slip(elements, actions, motion.events),
        ),
    )


def _compute_shaft_speeds(
    gearbox: Gearbox, crank: FloatArray, slip: Mapping[str, FloatArray]
) -> Mapping[str, FloatArray]:
    """Speeds (n,) of the members behind the starting clutches of a gearbox with dogs [rad/s]."""
    found: dict[str, FloatArray] = {}
    for name, element in gearbox.elements.items():
        if gearbox.dogs and element.a == gearbox.input:
            found[element.b] = crank - slip[name]
        elif gearbox.dogs and element.b == gearbox.input:
            found[element.a] = crank + slip[name]
    return found


def _build_converter_traces(
    gearbox: Gearbox, powertrain: Powertrain, motion: NetworkRun
) -> ConverterTraces | None:
    if gearbox.dogs:
        return None
    columns = motion.columns
    crank, turbine = columns["speed", CRANK], columns["speed", gearbox.input]
    return ConverterTraces(
        pump_torque=-columns["torque", f"{CONVERTER}.pump"],
        turbine_torque=columns["torque", f"{CONVERTER}.turbine"],
        speed_ratio=turbine / crank,
        torque_ratio=powertrain.converter.compute_torque_ratio(crank, turbine),
    )


def _build_maneuver(
    action: Action, motion: NetworkRun, power: Mapping[str, FloatArray]
) -> Maneuver:
    inside = slice(*np.searchsorted(motion.time, (action.start, action.end), side="right"))
    shaft_torque = motion.columns["shaft_torque", SHAFT][inside]
    events = [event for event in motion.events if action.start <= event.time <= action.end]

    def times(element: str | None, kind: str) -> list[float]:
        return [event.time for event in events if (event.element, event.kind) == (element, kind)]

    broke, locked = times(action.off_going, "break_away"), times(action.on_coming, "lock")
    return Maneuver(
        action=action,
        break_away=broke[0] if broke else None,
        lock=locked[-1] if locked else None,
        shaft_torque=(float(shaft_torque.min()), float(shaft_torque.max())),
        work=tuple(
            ElementWork(
                name,
                float(np.trapezoid(power[name][inside], motion.time[inside])),
                float(power[name][inside].max()),
            )
            for name in action.elements
        ),
    )


def _warn_vehicle_mismatch(gearbox: Gearbox, powertrain: Powertrain) -> tuple[str, ...]:
    """One sentence where the card's vehicle inertia is not that of the powertrain's mass."""
    inertia, mass = gearbox.require_drive().vehicle_inertia, powertrain.mass_inertia
    if _OF_MASS[0] <= inertia / mass <= _OF_MASS[1]:
        return ()
    return (
        f"the gearbox card's vehicle has {inertia:.4g} kg·m² at the wheel, the mass that rolls and "
        f"climbs {mass:.4g} kg·m²: correct vehicle_inertia_kgm2 on the card, or mass_kg and "
        "radius_m in [road]",
    )


def _warn_unwanted_slip(
    elements: Sequence[str], actions: Sequence[Action], events: Sequence[Event]
) -> tuple[str, ...]:
    """One sentence for each element that breaks away outside the actions it takes part in."""
    found: dict[str, float] = {}
    for event in events:
        if event.kind != "break_away" or event.element not in elements:
            continue
        wanted = any(
            event.element in action.elements and action.start <= event.time <= action.end
            for action in actions
        )
        if not wanted:
            found.setdefault(event.element, event.time)
    return tuple(
        f"{element} slips at {time:.2f} s where it should hold: the main pressure is too low"
        for element, time in found.items()
    )
