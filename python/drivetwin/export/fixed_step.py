# SPDX-License-Identifier: MIT
"""Runs as a fixed-step importer sees them: inputs known at its communication points only."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import InputError
from drivetwin.estimation.result.validation import Validation
from drivetwin.export.input_delays import ACTING_INPUTS, InputDelays
from drivetwin.export.targets import InputKind
from drivetwin.simulation.driveline_run import simulate
from drivetwin.simulation.dual_clutch import (
    Accuracy,
    DualClutch,
    FloatArray,
    Signal,
    State,
    Trajectory,
)
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import replace_run


@dataclass(frozen=True)
class Stepping:
    """Communication step [s] and the inputs between its points."""

    step: float
    kind: InputKind = InputKind.LINEAR

    def build_grid(self, start: float, end: float) -> FloatArray:
        """Communication points from `start` as far as whole steps reach. Raises InputError."""
        if not 1e-5 <= self.step <= 0.1:
            raise InputError(f"a step of {self.step:g} s", "choose one from 1e-5 s to 0.1 s")
        count = int((end - start) / self.step + 1e-6)
        if count < 1:
            raise InputError(
                f"one step of {self.step:g} s is longer than the {end - start:g} s to simulate",
                "choose a shorter step",
            )
        return np.asarray(start + self.step * np.arange(count + 1), dtype=np.float64)


def sample_signals(signals: Sequence[Signal], time: FloatArray) -> FloatArray:
    """Values (n, signals) of inputs at `time` (n,) [s], linear between their own samples."""
    columns = [np.interp(time, one.arrival, one.values) for one in signals]
    return np.column_stack(columns)


def run_fixed_step(
    model: DualClutch,
    start: State,
    time: FloatArray,
    inputs: FloatArray,
    kind: InputKind,
    delays: InputDelays = ACTING_INPUTS,
) -> Trajectory:
    """Run with `inputs` (n, 3) given at `time` (n,): engine torque, then pressures in the order of
    the elements; integrated to round-off. Where inputs jump, torques are those from there on.

    `delays` are those of the exported model. Raises InputError for an inconsistent description; a
    run that fails returns its status.
    """
    lines = (delays.torque_line, delays.pressure_line, delays.pressure_line)
    torque, *pressures = (
        _build_signal(time, *_delay_column(time, column, kind, line))
        for column, line in zip(inputs.T, lines, strict=True)
    )
    names = [element.name for element in model.elements]
    given = dict(zip(names, pressures, strict=True))
    return simulate(model, torque, given, start, time, accuracy=Accuracy(exact=True))


def _delay_column(
    time: FloatArray, values: FloatArray, kind: InputKind, delay: float
) -> tuple[FloatArray, FloatArray]:
    """Values (n - 1,) of an input behind its delay line at the begin and at the end of each step.

    The line is linear between the samples, of which those after the begin of a step are not known
    yet if inputs are held.
    """
    first, last = (np.interp(ends - delay, time, values) for ends in (time[:-1], time[1:]))
    if kind is InputKind.HOLD:
        last = np.where(time[1:] - delay > time[:-1], values[:-1], last)
    return first, last


def _build_signal(time: FloatArray, first: FloatArray, last: FloatArray) -> Signal:
    """Signal that is linear over each step; a repeated time stamp is a jump."""
    if np.array_equal(first[1:], last[:-1]):
        return Signal(time, np.append(first, last[-1:]))
    return Signal(np.repeat(time, 2)[1:-1], np.column_stack((first, last)).ravel())


def sample_inputs(shift: Validation, stepping: Stepping) -> tuple[FloatArray, FloatArray]:
    """Communication points (n,) over the window of a shift and its measured inputs (n, 3) there."""
    time = stepping.build_grid(float(shift.trajectory.time[0]), float(shift.trajectory.time[-1]))
    pressures = (shift.pressures[element.name] for element in shift.model.elements)
    return time, sample_signals((shift.engine_torque, *pressures), time)


def get_start_state(shift: Validation) -> State:
    """State that the simulation of a shift starts from."""
    run = shift.trajectory
    return State(
        engine_speed=float(run.engine_speed[0]),
        output_speed=float(run.output_speed[0]),
        wheel_speed=float(run.wheel_speed[0]),
        twist=float(run.twist[0]),
        locked=(shift.shift.offgoing,),
    )


def rerun_fixed_step(
    shift: Validation, twin: Twin, log: ShiftLog, stepping: Stepping
) -> Validation:
    """A simulated shift as a fixed-step importer of the twin would have it."""
    time, inputs = sample_inputs(shift, stepping)
    run = run_fixed_step(shift.model, get_start_state(shift), time, inputs, stepping.kind)
    return replace_run(shift, twin, log, run)
