# SPDX-License-Identifier: MIT
"""Run a plan over the whole driveline, with the driver that the gearbox needs."""

from __future__ import annotations

from drivetwin._util.progress import notify_progress
from drivetwin.drive.dogs import DogDriver
from drivetwin.drive.driver import STEP, Driver, build_grid
from drivetwin.drive.plan import Plan
from drivetwin.drive.powertrain import Powertrain
from drivetwin.drive.result import TRACE_STEP, DriveRun, build_drive_run
from drivetwin.errors import InputError
from drivetwin.gearbox import Gearbox


def run(gearbox: Gearbox, powertrain: Powertrain, plan: Plan) -> DriveRun:
    """Drive the plan from standstill in the lowest gear and return the motion.

    Raises SimulationError where a leg does not end, a shift does not reach synchronism, or the
    simulation does not complete; ReductionError for a shift that is not one element off and one on;
    InputError for a plan without legs or a gearbox that cannot be driven.
    """
    if not plan:
        raise InputError("the plan has no legs", "give at least one leg, with pedal and end")
    driver = (DogDriver if gearbox.dogs else Driver)(gearbox, powertrain)
    state = driver.start_drive(plan[0])
    for count, leg in enumerate(plan):
        notify_progress(count / (len(plan) + 1))
        state = driver.run_leg(leg, state)
    motion = driver.simulate(state.schedule, build_grid(0, round(state.time / STEP)), audit=True)
    energy = driver.simulate_energy(state.schedule, motion.time[::TRACE_STEP])
    return build_drive_run(gearbox, powertrain, state.schedule, state.actions, motion, energy)
