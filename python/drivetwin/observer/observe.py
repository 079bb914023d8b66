# SPDX-License-Identifier: MIT
"""One entry for both observers."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.observer.ensemble import simulate_observed
from drivetwin.observer.kind import Observer
from drivetwin.observer.result import Observation
from drivetwin.observer.smooth import smooth
from drivetwin.shifts.coverage import trim_to_recorded, trim_to_window
from drivetwin.shifts.lockup_clutch import refer_to_turbine
from drivetwin.shifts.shift import Shift
from drivetwin.twin.twin import Twin
from drivetwin.vehicle.spec import PriorValue

FAR = 15.0
"""Longest time [s] of the gears held before and after a shift: a second of the smoother takes some
25 MB, and what happens so far away says nothing of the shift."""


def estimate_torques(
    twin: Twin, log: ShiftLog, shift: Shift, by: Observer = Observer.SMOOTHER
) -> Observation:
    """Torques of one shift of a log with 95 % bands; an output torque in the log is not used.

    Where the converter is open and the twin has its map, its turbine stands for the engine. The
    gears before and after the shift count as far as its inputs were recorded, which the notes say,
    and for FAR at most.
    Raises MissingParameterError where the twin is incomplete, MissingChannelError and InputError
    where the log is, DamagedChannelError where an input has a gap in the shift, SimulationError
    where the twin's own run fails.
    """
    log = refer_to_turbine(log, twin.build_card(), shift)
    fills = {one.name: PriorValue(one.P0) for one in twin.build_dual_clutch(shift).elements}
    whole = trim_to_window(trim_to_recorded(log, shift, fills, twin.i_in), (FAR, FAR))
    found = (smooth if by is Observer.SMOOTHER else simulate_observed)(twin, log, whole)
    cuts = whole.warnings[len(shift.warnings) :]
    return replace(found, notes=(*cuts, *found.notes))
