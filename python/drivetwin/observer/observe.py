# SPDX-License-Identifier: MIT
"""Estimate the torques of a shift from speeds and engine torque."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin._util.check_arguments import check_arguments
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import SimulationError
from drivetwin.findings import render
from drivetwin.observer.result import Band, FloatArray, Observation
from drivetwin.observer.smooth import smooth
from drivetwin.shifts.coverage import trim_to_recorded, trim_to_window
from drivetwin.shifts.lockup_clutch import refer_to_turbine
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.added_elements import describe_added_elements
from drivetwin.simulation.dual_clutch import Trajectory
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import simulate_shift
from drivetwin.vehicle.spec import PriorValue

FAR = 15.0
"""Longest time [s] of the gears held before and after a shift. One second of the smoother takes
about 25 MB, and more distant samples contain no information on the shift."""


@check_arguments
def estimate_torques(twin: Twin, log: ShiftLog, shift: Shift) -> Observation:
    """Estimate the torques of one shift with 95 % bands, without any output torque in the log.

    If the converter is open and the twin has its map, the turbine torque replaces the engine
    torque. The gears before and after the shift are used as far as the inputs were recorded, and
    for FAR at most; the notes contain any cut.
    The smoother's model is the dual clutch; where the twin has other elements, their effect on its
    own run widens the bands.
    Raises MissingParameterError where the twin is incomplete, MissingChannelError and InputError
    where the log is incomplete, DamagedChannelError where an input has a gap in the shift,
    SimulationError where the twin's own run fails.
    """
    log = refer_to_turbine(log, twin.build_card(), shift)
    fills = {one.name: PriorValue(one.P0) for one in twin.build_dual_clutch(shift).elements}
    whole = trim_to_window(trim_to_recorded(log, shift, fills, twin.i_in), (FAR, FAR))
    if twin.added_element_values:
        found = _add_element_error(smooth(twin.drop_added_elements(), log, whole), twin, log, whole)
    else:
        found = smooth(twin, log, whole)
    cuts = render(whole.findings[len(shift.findings) :])
    return replace(found, notes=(*cuts, *found.notes))


def _add_element_error(found: Observation, twin: Twin, log: ShiftLog, shift: Shift) -> Observation:
    """Widen the bands by the effect of the added elements on the run of the twin itself."""
    channels = {role: one for role, one in log.channels.items() if role != "output_torque"}
    quiet = replace(log, channels=channels)
    runs = [simulate_shift(one, quiet, shift) for one in (twin, twin.drop_added_elements())]
    for one in runs:
        if one.status != "completed":
            raise SimulationError(
                f"the simulation of shift {shift.start_gear}-{shift.end_gear} ended: {one.status}",
                "identify the log again without the added element",
            )
    whole, reduced = (_collect_torques(one.trajectory) for one in runs)

    def widen(name: str, band: Band) -> Band:
        error = np.interp(found.time, runs[0].trajectory.time, whole[name] - reduced[name])
        return Band(band.value, np.hypot(band.std, error))

    clutches = {name: widen(name, band) for name, band in found.clutch_torque.items()}
    note = f"bands contain the error by {describe_added_elements(twin.added_element_values)}"
    return replace(
        found,
        output_torque=widen("output_torque", found.output_torque),
        clutch_torque=clutches,
        notes=(*found.notes, note),
    )


def _collect_torques(run: Trajectory) -> dict[str, FloatArray]:
    """Collect the torques (n,) of a run [N m]: `output_torque`, and those of the elements."""
    return {"output_torque": run.shaft_torque, **run.clutch_torque}
