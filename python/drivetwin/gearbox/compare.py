# SPDX-License-Identifier: MIT
"""Simulate whole gearbox and dual-clutch form over one reference shift and compare them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin.errors import SimulationError
from drivetwin.gearbox.maneuver import (
    CouplingError,
    Maneuver,
    Traces,
    build_signals,
    build_time_grid,
    plan,
    solve_gear,
)
from drivetwin.gearbox.reduction import Reduction, build_network_elements
from drivetwin.gearbox.spec import Drive
from drivetwin.simulation.driveline import (
    SHAFT,
    WHEEL,
    build_engine_side,
    build_shaft,
    build_vehicle,
    require_own_nodes,
)
from drivetwin.simulation.driveline_run import simulate as simulate_dual_clutch
from drivetwin.simulation.dual_clutch import (
    ENGINE_TORQUE,
    DualClutch,
    FloatArray,
    RoadLoad,
    Signal,
    State,
)
from drivetwin.simulation.network import Element, Start
from drivetwin.simulation.network import simulate as simulate_network

_COMPLETED = "completed"


@dataclass(frozen=True, eq=False)
class Comparison:
    """The whole gearbox and its dual-clutch form over `time` (n,) [s]."""

    time: FloatArray
    full: Traces
    form: Traces

    @property
    def error(self) -> CouplingError:
        """Largest differences."""
        return self.full.compute_largest_difference(self.form)


def compare(
    reduction: Reduction, drive: Drive | None = None, *, keep_coupling: bool = False
) -> Comparison:
    """Simulate the reference shift with the whole gearbox and with its dual-clutch form.

    With `keep_coupling` the form carries M12, and both agree to the integrator's accuracy.
    Raises ReductionError where no reference shift can be planned, SimulationError where a run does
    not complete.
    """
    drive = drive or reduction.gearbox.require_drive()
    maneuver = plan(reduction, drive)
    time = build_time_grid(maneuver)
    full = _simulate_whole_gearbox(reduction, maneuver, time)
    form = _simulate_dual_clutch(reduction, maneuver, time, keep_coupling=keep_coupling)
    return Comparison(time, full, form)


def _start(reduction: Reduction, maneuver: Maneuver, coupling: float) -> tuple[float, float, float]:
    """Speeds of output and wheel and twist of the shaft in steady acceleration in the old gear.

    The speeds are the same with and without `coupling` [kg m^2] and lead to those planned for the
    release.
    """
    drive, i, new = maneuver.drive, maneuver.old_ratio, reduction.on_coming
    inertia = (drive.engine_inertia + reduction.M11) * i**2 + reduction.M22
    gained = maneuver.compute_speed_gain(inertia, i / new.i_c - new.i_out)
    output = maneuver.output_speed - gained
    total = inertia + 2.0 * coupling * i + maneuver.vehicle
    acceleration = (i * maneuver.engine_torque - maneuver.load) / total
    twist = (maneuver.load + maneuver.vehicle * acceleration) / drive.shaft_stiffness
    return output, output / drive.final_drive, twist


@dataclass(frozen=True, eq=False)
class WholeGearbox:
    """The reference shift with all members: elements, inputs by name, start."""

    elements: tuple[Element, ...]
    inputs: dict[str, Signal]
    start: Start


def build_whole_gearbox(reduction: Reduction, maneuver: Maneuver) -> WholeGearbox:
    """State the reference shift for the network."""
    gearbox = reduction.gearbox
    torque, pressures = build_signals(reduction, maneuver)
    dogs = [name for name in reduction.common if name in gearbox.dogs]
    gearing = build_network_elements(gearbox, dogs)
    require_own_nodes(gearing)
    elements = [*gearing, *_build_surroundings(reduction, maneuver)]
    names = [e["name"] for e in elements if e["type"] == "clutch"]
    zero = Signal(torque.time, np.zeros_like(torque.time))
    inputs = {ENGINE_TORQUE: torque} | {name: pressures.get(name, zero) for name in names}
    output, wheel, twist = _start(reduction, maneuver, reduction.M12)
    held = (*names, *gearbox.freewheels)
    friction = [name for name in reduction.common if name in held]
    # Dogs of the new gear turn some of what idles in the old one; what idles even so stands still.
    engaged = (reduction.off_going.element, *reduction.common)
    old = replace(gearbox.get_gear(reduction.from_gear), elements=engaged)
    in_gear = solve_gear(replace(gearbox, gears=(old,)), old.name).speeds
    speed_in = maneuver.old_ratio * output
    speeds = {member: speed_in * (each or 0.0) for member, each in in_gear.items()}
    start = Start(
        speeds=speeds | {WHEEL: wheel},
        twists={SHAFT: twist},
        locked=(reduction.off_going.element, *friction),
    )
    return WholeGearbox(tuple(elements), inputs, start)


def _simulate_whole_gearbox(reduction: Reduction, maneuver: Maneuver, time: FloatArray) -> Traces:
    gearbox, stated = reduction.gearbox, build_whole_gearbox(reduction, maneuver)
    run = simulate_network(
        stated.elements,
        stated.inputs,
        stated.start,
        time,
        [("shaft_torque", SHAFT), ("speed", gearbox.input), ("speed", gearbox.output)],
    )
    _require_completed(run.status, "the whole gearbox")
    shaft_torque, input_speed, output_speed = run.columns.values()
    return Traces(shaft_torque, input_speed, output_speed)


def _build_surroundings(reduction: Reduction, maneuver: Maneuver) -> list[Element]:
    """Engine, shaft, final drive, vehicle and load around the gearbox."""
    drive, gearbox = maneuver.drive, reduction.gearbox
    side = drive.build_output_side(RoadLoad(constant=maneuver.load * drive.final_drive))
    engine = build_engine_side(drive.engine_inertia, node=gearbox.engine_member)
    return [*engine, *build_shaft(side, gearbox.output), *build_vehicle(side)]


def build_dual_clutch_form(
    reduction: Reduction, maneuver: Maneuver, *, keep_coupling: bool = False
) -> tuple[DualClutch, State]:
    """Model and start of the reference shift in the dual-clutch form."""
    model = reduction.build_dual_clutch(maneuver.drive, keep_coupling=keep_coupling)
    model = replace(model, load=RoadLoad(constant=maneuver.load * maneuver.drive.final_drive))
    coupling = reduction.M12 if keep_coupling else 0.0
    output, wheel, twist = _start(reduction, maneuver, coupling)
    locked = (reduction.off_going.element,)
    return model, State(maneuver.old_ratio * output, output, wheel, twist, locked)


def _simulate_dual_clutch(
    reduction: Reduction, maneuver: Maneuver, time: FloatArray, *, keep_coupling: bool
) -> Traces:
    model, start = build_dual_clutch_form(reduction, maneuver, keep_coupling=keep_coupling)
    torque, pressures = build_signals(reduction, maneuver)
    run = simulate_dual_clutch(
        model, torque, {each.name: pressures[each.name] for each in model.elements}, start, time
    )
    _require_completed(run.status, "the dual-clutch form")
    return Traces(run.shaft_torque, run.engine_speed, run.output_speed)


def _require_completed(status: str, what: str) -> None:
    if status != _COMPLETED:
        raise SimulationError(
            f"the simulation of {what} ended: {status}",
            "look at the drive and the capacities in the card",
        )
