# SPDX-License-Identifier: MIT
"""One entry for both observers."""

from __future__ import annotations

from dataclasses import replace

from drivetwin._util.check_arguments import check_arguments
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.findings import render
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
"""Longest time [s] of the gears held before and after a shift. One second of the smoother takes
about 25 MB, and more distant samples contain no information on the shift."""


@check_arguments
def estimate_torques(
    twin: Twin, log: ShiftLog, shift: Shift, by: Observer = Observer.SMOOTHER
) -> Observation:
    """Estimate the torques of one shift with 95 % bands, without any output torque in the log.

    If the converter is open and the twin has its map, the turbine torque replaces the engine
    torque. The gears before and after the shift are used as far as the inputs were recorded, and
    for FAR at most; the notes contain any cut.
    Raises MissingParameterError where the twin is incomplete, InputError for the smoother where
    its plant has a part beside the dual clutch, MissingChannelError and InputError where the log is
    incomplete, DamagedChannelError where an input has a gap in the shift, SimulationError
    where the twin's own run fails.
    """
    if by is Observer.SMOOTHER:
        twin.require_dual_clutch("the smoother")
    log = refer_to_turbine(log, twin.build_card(), shift)
    fills = {one.name: PriorValue(one.P0) for one in twin.build_dual_clutch(shift).elements}
    whole = trim_to_window(trim_to_recorded(log, shift, fills, twin.i_in), (FAR, FAR))
    found = (smooth if by is Observer.SMOOTHER else simulate_observed)(twin, log, whole)
    cuts = render(whole.findings[len(shift.findings) :])
    return replace(found, notes=(*cuts, *found.notes))
