# SPDX-License-Identifier: MIT
"""One entry for both observers."""

from __future__ import annotations

from drivetwin.logs.shiftlog import ShiftLog
from drivetwin.observer.ensemble import simulate_observed
from drivetwin.observer.observed import Observation, Observer
from drivetwin.observer.smooth import smooth
from drivetwin.shifts.converter import behind_converter
from drivetwin.shifts.shift import Shift
from drivetwin.twin import Twin


def observed(
    twin: Twin, log: ShiftLog, shift: Shift, by: Observer = Observer.SMOOTHER
) -> Observation:
    """Torques of one shift of a log with 95 % bands; an output torque in the log is not used.

    Where the converter is open and the twin has its map, its turbine stands for the engine.
    Raises MissingParameterError where the twin is incomplete, MissingChannelError and InputError
    where the log is, SimulationError where the twin's own run fails.
    """
    log = behind_converter(log, twin.card(), shift)
    return (
        smooth(twin, log, shift) if by is Observer.SMOOTHER else simulate_observed(twin, log, shift)
    )
