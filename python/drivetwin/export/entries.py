# SPDX-License-Identifier: MIT
"""Subject of an export with its numbers by name, and its simulation at a fixed step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import InputError
from drivetwin.estimation.result.validation import Validation
from drivetwin.export.targets import InputKind
from drivetwin.simulation.added_elements import (
    NO_ADDED_ELEMENTS,
    AddedElements,
    describe_added_elements,
)
from drivetwin.simulation.driveline_run import DrivelineTask, simulate
from drivetwin.simulation.dual_clutch import (
    Accuracy,
    DualClutch,
    FloatArray,
    FrictionTable,
    Signal,
    State,
    Trajectory,
)
from drivetwin.twin.twin import PRESSURE_DELAY, Twin, build_nominal_shift
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


DEFAULT_ENGINE_SPEED = 150.0
"""Default engine speed [rad/s] at the start, for a twin without recorded speeds."""


@dataclass(frozen=True, eq=False)
class Subject:
    """A model with a name and a start; `elements` of the model are off-going, on-coming."""

    name: str
    model: DualClutch
    start: State
    note: str = ""
    """Origin of the numbers, one line."""
    delays: InputDelays = ACTING_INPUTS
    """Delays between the inputs of a log and the acting inputs."""
    added: AddedElements = NO_ADDED_ELEMENTS
    """Elements beside the model."""
    added_element_names: str = ""
    """Names of the added elements in words."""

    def reduce(self) -> Subject:
        """Return the dual clutch alone, as C and FMU hold it; the note names what is left out."""
        if self.added is NO_ADDED_ELEMENTS:
            return self
        notes = [self.note] if self.note else []
        note = "; ".join([*notes, f"without {self.added_element_names}"])
        return replace(self, added=NO_ADDED_ELEMENTS, added_element_names="", note=note)

    def compute_reduction_error(self, time: FloatArray, inputs: FloatArray) -> float:
        """Compute the largest error of the output torque by the elements that `reduce` leaves out.

        Parameters
        ----------
        time : (n,)
            Instants [s].
        inputs : (n, 3)
            Engine torque [N m] and pressures [Pa] of both elements.

        Returns
        -------
        float
            Error over the largest output torque [-]; NaN where a run does not complete.
        """
        torque, *pressures = (Signal(time, column) for column in inputs.T)
        names = (one.name for one in self.model.elements)
        acting = dict(zip(names, pressures, strict=True))
        whole, reduced = (
            DrivelineTask(self.model, added, torque, acting, self.start, time).simulate()
            for added in (self.added, NO_ADDED_ELEMENTS)
        )
        error = np.max(np.abs(reduced.shaft_torque - whole.shaft_torque))
        return float(error / np.max(np.abs(whole.shaft_torque)))


def build_subject(twin: Twin, gears: tuple[str, str] | None = None) -> Subject:
    """The model of the shift between two gears of a twin; by default its first upshift.

    It starts in the old gear at the mean engine speed of the twin's logs, without acceleration.
    Raises InputError for a shift that the twin does not have, MissingParameterError where a
    parameter that the simulation needs was not identified.
    """
    shift = build_nominal_shift(twin, gears)
    model = twin.build_dual_clutch(shift)
    delays = InputDelays.from_twin(twin)
    return Subject(
        name=f"{twin.name} {shift.start_gear}-{shift.end_gear}",
        model=model,
        start=compute_steady_start(model, shift.offgoing, _compute_usual_speed(twin)),
        note=build_note(twin, delays),
        delays=delays,
        added=twin.build_added_elements(model),
        added_element_names=describe_added_elements(twin.added_element_values),
    )


def build_note(twin: Twin, delays: InputDelays) -> str:
    """Build the line on the origin of the numbers and the delays of the inputs."""
    origin = f"identified by the {twin.method} method, loss law {twin.loss_law}"
    inputs = delays.describe()
    return f"{origin}; inputs: {inputs}" if inputs else origin


def compute_steady_start(model: DualClutch, locked: str, engine_speed: float) -> State:
    """Constant speed with one element locked: the shaft carries the load, nothing slips."""
    output_speed = engine_speed / model.get_overall_ratio(locked)
    wheel_speed = output_speed / model.i_f
    twist = model.load.evaluate(wheel_speed) / model.i_f / model.k_o
    return State(engine_speed, output_speed, wheel_speed, twist, (locked,))


def _compute_usual_speed(twin: Twin) -> float:
    low, high = twin.validity.get("speed", (DEFAULT_ENGINE_SPEED, DEFAULT_ENGINE_SPEED))
    return 0.5 * (low + high)


INF = math.inf


@dataclass(frozen=True)
class Entry:
    """One number of the model.

    `name` is structured (`B2.P0`, `load.constant`), `field` its place in `dt_params` of
    `dt_model.h`; `unit` is SI, ASCII; `least` and `most` bound what `dt_check` accepts.
    """

    name: str
    field: str
    value: float
    unit: str
    meaning: str
    least: float = -INF
    most: float = INF


def list_entries(model: DualClutch) -> tuple[Entry, ...]:
    """All numbers of a model, in the order of `dt_params`."""
    load = model.load
    return (
        Entry("J1", "J1", model.J1, "kg*m^2", "inertia before the input gear", 0.0),
        Entry("J2e", "J2e", model.J2e, "kg*m^2", "inertia behind it, at the engine", 0.0),
        Entry("eta", "eta", model.eta, "1", "lumped gear efficiency", 0.0, 1.5),
        Entry("i_in", "i_in", model.i_in, "1", "input gear ratio"),
        Entry("J_out", "J_out", model.J_out, "kg*m^2", "output side before the shaft", 0.0),
        Entry("i_f", "i_f", model.i_f, "1", "final drive ratio"),
        Entry("J_v", "J_v", model.J_v, "kg*m^2", "vehicle inertia at the wheel", 0.0),
        Entry("k_o", "k_o", model.k_o, "N*m/rad", "output shaft stiffness", 0.0),
        Entry("c_o", "c_o", model.c_o, "N*m*s/rad", "output shaft damping", 0.0),
        Entry("load.constant", "load_constant", load.constant, "N*m", "load at the wheel"),
        Entry("load.rolling", "load_rolling", load.rolling, "N*m", "rolling resistance", 0.0),
        Entry("load.aero", "load_aero", load.aero, "N*m*s^2/rad^2", "load over speed squared", 0.0),
        *(entry for index in range(2) for entry in _list_element_entries(model, index)),
    )


def _list_element_entries(model: DualClutch, index: int) -> tuple[Entry, ...]:
    element = model.elements[index]

    def entry(field: str, value: float, unit: str, meaning: str, least: float = -INF) -> Entry:
        inner = field if field in _OWN_FIELDS else f"friction.{field}"
        name = f"{element.name}.{field}"
        return Entry(name, f"clutch[{index}].{inner}", value, unit, meaning, least)

    own = (
        entry("i_c", element.i_c, "1", "ratio between input gear and clutch"),
        entry("i_out", element.i_out, "1", "ratio between clutch and output"),
        entry("gain", element.gain, "m^3", "surfaces, de-rating, area, effective radius", 0.0),
        entry("P0", element.P0, "Pa", "pressure at which the fill ends"),
        entry("peak", element.peak, "1", "static over kinetic capacity at zero slip", 1.0),
        entry("drum_inertia", element.drum_inertia, "kg*m^2", "inertia of the clutch drum", 0),
    )
    law = element.friction
    if isinstance(law, FrictionTable):
        points = range(len(law.slip))
        # The first slip is zero by definition, not a parameter.
        slips = (
            entry(f"slip[{i}]", law.slip[i], "rad/s", "slip of the friction table", 0.0)
            for i in points
            if i > 0
        )
        values = (entry(f"mu[{i}]", law.mu[i], "1", "friction at that slip", 0.0) for i in points)
        return (*own, *slips, *values)
    return (
        *own,
        entry("mu_c", law.mu_c, "1", "friction after the exponential has died out", 0.0),
        entry("mu_s", law.mu_s, "1", "friction at zero slip", 0.0),
        entry("v_s", law.v_s, "rad/s", "slip over which the exponential falls by e", 0.0),
        entry("mu_v", law.mu_v, "s/rad", "viscous slope"),
    )


_OWN_FIELDS = ("i_c", "i_out", "gain", "P0", "peak", "drum_inertia")


def start_entries(start: State) -> tuple[Entry, ...]:
    """The numbers a run starts from; `field` is the place in `dt_start`."""
    return (
        Entry("start.engine_speed", "engine_speed", start.engine_speed, "rad/s", "engine speed"),
        Entry("start.output_speed", "output_speed", start.output_speed, "rad/s", "output speed"),
        Entry("start.wheel_speed", "wheel_speed", start.wheel_speed, "rad/s", "wheel speed"),
        Entry("start.twist", "twist", start.twist, "rad", "twist of the output shaft"),
    )


def delay_entries(delays: InputDelays) -> tuple[Entry, ...]:
    """The delays inside the model; `field` is the place in `dt_delays`."""
    return (
        Entry("delay.torque", "engine_torque", delays.torque_line, "s", "delay of the input"),
        Entry("delay.pressure", "pressure", delays.pressure_line, "s", "delay of the inputs"),
        Entry("delay.lag", "lag", delays.lag, "s", "delay of the outputs"),
    )


def get_lock_index(model: DualClutch, start: State) -> int:
    """0: nothing is locked at the start; k: the k-th element is."""
    names = [element.name for element in model.elements]
    return names.index(start.locked[0]) + 1 if start.locked else 0
