# SPDX-License-Identifier: MIT
"""Measured shift packed with an export, and the model with the same initial state."""

from __future__ import annotations

from pathlib import PurePath

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import NoShiftError, Where
from drivetwin.export.fixed_step import Stepping, get_start_state, sample_inputs
from drivetwin.export.fmu.experiment import Experiment
from drivetwin.export.input_kind import DEFAULT_STEP
from drivetwin.export.subject import InputDelays, Subject, build_note
from drivetwin.shifts.detect import require_shifts
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import simulate_shift


def build_measured_subject(
    twin: Twin, log: ShiftLog, gears: tuple[str, str] | None = None
) -> tuple[Subject, Experiment]:
    """Model of the first shift of a log between `gears` (None: any), and that shift's inputs.

    Raises InputError for a plant with a part beside the dual clutch, NoShiftError where there is
    no such shift, and what the validation of a shift raises.
    """
    twin.require_dual_clutch("the export")
    found = require_shifts(log, twin.build_card()).shifts
    wanted = [one for one in found if gears in (None, (one.start_gear, one.end_gear))]
    if not wanted:
        raise NoShiftError(
            f"the log has no shift {'-'.join(gears or ())}",
            f"choose one of {', '.join(f'{s.start_gear}-{s.end_gear}' for s in found)}",
            Where(file=log.source),
        )
    shift = simulate_shift(twin, log, wanted[0])
    name = f"{wanted[0].start_gear}-{wanted[0].end_gear}"
    source = PurePath(log.source).name
    time, inputs = sample_inputs(shift, Stepping(DEFAULT_STEP))
    delays = InputDelays.from_twin(twin)
    subject = Subject(
        name=f"{twin.name} {name}",
        model=shift.model,
        start=get_start_state(shift),
        note=build_note(twin, delays),
        delays=delays,
    )
    return subject, Experiment(f"shift {name} of {source}", time, inputs, DEFAULT_STEP)
