# SPDX-License-Identifier: MIT
"""Results of a drive: motion, converter, and the friction work of every shift."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.drive.network import (
    BRAKE,
    CONVERTER,
    ENGINE,
    PEDAL,
    get_crank,
    list_friction_elements,
)
from drivetwin.drive.powertrain import Powertrain
from drivetwin.drive.schedule import Schedule
from drivetwin.gearbox import Gearbox
from drivetwin.simulation.driveline import CRANK, LOAD, SHAFT, WHEEL
from drivetwin.simulation.dual_clutch import EnergyAudit, Event, FloatArray
from drivetwin.simulation.network import NetworkRun, Output

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
