# SPDX-License-Identifier: MIT
"""Measured shift packed with an export, and the model with the same initial state."""

from __future__ import annotations

from dataclasses import replace
from pathlib import PurePath

import numpy as np

from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.errors import NoShiftError, Where
from drivetwin.estimation.result.validation import Validation
from drivetwin.export.fixed_step import Stepping, get_start_state, sample_inputs
from drivetwin.export.fmu.experiment import Experiment
from drivetwin.export.input_delays import InputDelays
from drivetwin.export.subject import Subject, build_note
from drivetwin.export.targets import DEFAULT_STEP
from drivetwin.shifts.detect import require_shifts
from drivetwin.shifts.kinematics import get_shift_pressures
from drivetwin.shifts.lockup_clutch import refer_to_turbine
from drivetwin.simulation.added_elements import describe_added_elements
from drivetwin.simulation.dual_clutch import FloatArray
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import simulate_shift


def build_measured_subject(
    twin: Twin,
    log: ShiftLog,
    gears: tuple[str, str] | None = None,
    *,
    as_logged: bool = False,
) -> tuple[Subject, Experiment]:
    """Model of the first shift of a log between `gears` (None: any), and that shift's inputs.

    With `as_logged` the inputs are the log's own signals, and the model runs later by their delay.
    Raises NoShiftError where there is no such shift, and what the validation of a shift raises.
    """
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
    delays = InputDelays.from_twin(twin)
    if as_logged:
        shown = refer_to_turbine(log, twin.build_card(), shift.shift)
        delays = replace(delays, as_logged=True, held=_get_hold(shown["engine_torque"]))
        time, inputs = _sample_log(shown, shift, delays.lag)
    else:
        time, inputs = sample_inputs(shift, Stepping(DEFAULT_STEP))
    subject = Subject(
        name=f"{twin.name} {name}",
        model=shift.model,
        start=get_start_state(shift),
        note=build_note(twin, delays),
        delays=delays,
        added=twin.build_added_elements(shift.model),
        added_element_names=describe_added_elements(twin.added_element_values),
    )
    return subject, Experiment(f"shift {name} of {source}", time, inputs, DEFAULT_STEP)


def _get_hold(channel: Channel) -> float:
    """Interval [s] over which a channel repeats each value; 0 where each sample is an update."""
    return channel.raster.period if channel.held and channel.raster is not None else 0.0


def _sample_log(log: ShiftLog, shift: Validation, lag: float) -> tuple[FloatArray, FloatArray]:
    """Communication points (n,) of a model that runs `lag` [s] late, and the log's inputs (n, 3).

    Inputs are the samples as recorded, linear in between. The first point is `lag` after the
    instant of the start state.
    """
    first, last = (float(shift.trajectory.time[place]) for place in (0, -1))
    time = Stepping(DEFAULT_STEP).build_grid(first + lag, last)
    pressures = get_shift_pressures(log, shift.shift)
    names = (element.name for element in shift.model.elements)
    channels = (log["engine_torque"], *(pressures[name] for name in names))
    columns = [np.interp(time, one.time, one.values) for one in channels]
    return time, np.column_stack(columns)
