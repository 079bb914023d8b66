# SPDX-License-Identifier: MIT
"""Runs as a fixed-step importer computes them: inputs at communication points, with delays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import InputError
from drivetwin.estimation.result.validation import Validation
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
from drivetwin.twin.twin import PRESSURE_DELAY, Twin
from drivetwin.validation.simulate_log import replace_run


@dataclass(frozen=True)
class InputDelays:
    """Delays [s] between the inputs of a log and the acting inputs of the model.

    A log shows the engine torque `torque` after it acts. Pressures act `pressure` after the log
    shows them. Both may be negative. With `as_logged` the model takes the inputs as a log shows
    them: delay lines in the model make up for the delays, and the outputs are later by `lag`. A log
    that repeats the engine torque for the update interval `held` shows it later by half of that.
    """

    torque: float = 0.0
    pressure: float = 0.0
    as_logged: bool = False
    held: float = 0.0

    @classmethod
    def from_twin(cls, twin: Twin) -> InputDelays:
        """Return the identified delays of a twin."""
        return cls(twin.get_value("te_delay", 0.0), twin.get_value(PRESSURE_DELAY, 0.0))

    @property
    def lag(self) -> float:
        """Delay [s] of model and outputs: the largest advance that a logged input would need.

        Zero if the model takes acting inputs.
        """
        return max(0.0, self._torque_delay, -self.pressure) if self.as_logged else 0.0

    @property
    def torque_line(self) -> float:
        """Delay [s] of the engine torque inside the model, at least 0."""
        return self.lag - self._torque_delay if self.as_logged else 0.0

    @property
    def pressure_line(self) -> float:
        """Delay [s] of the pressures inside the model, at least 0."""
        return self.lag + self.pressure if self.as_logged else 0.0

    @property
    def _torque_delay(self) -> float:
        """Mean delay [s] of the logged engine torque."""
        return self.torque + 0.5 * self.held

    def describe_torque(self) -> str:
        """Describe how a logged engine torque becomes the input; empty without a delay."""
        return self._describe_input(-self.torque, self.torque_line)

    def describe_pressure(self) -> str:
        """Describe how a logged pressure becomes the input; empty without a delay."""
        return self._describe_input(self.pressure, self.pressure_line)

    def describe_outputs(self) -> str:
        """Describe the delay of the outputs; empty without one."""
        return f"{self.lag:.5g} s later than the motion" if self.lag else ""

    def describe(self) -> str:
        """Describe inputs and outputs in one line; empty without a delay."""
        parts = (
            ("engine torque", self.describe_torque()),
            ("pressures", self.describe_pressure()),
            ("outputs", self.describe_outputs()),
        )
        return "; ".join(f"{name} {text}" for name, text in parts if text)

    def _describe_input(self, late: float, line: float) -> str:
        """Describe an input that acts `late` [s] after the log shows it."""
        if not self.as_logged:
            return _describe_shift(late)
        if not (self.lag or self.torque_line or self.pressure_line):
            return ""
        return "as logged" + (f", delayed by {line:.5g} s in the model" if line else "")


ACTING_INPUTS = InputDelays()
"""Delays of a model that takes acting inputs."""


def _describe_shift(late: float) -> str:
    """Describe an input that acts `late` [s] after the log shows it, and how to shift the log."""
    if late == 0.0:
        return ""
    way, side = ("delay", "after") if late > 0.0 else ("advance", "before")
    size = f"{abs(late):.5g} s"
    return f"as it acts, {size} {side} the log shows it: {way} the logged signal by {size}"


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
