# SPDX-License-Identifier: MIT
"""Subject of an export: the dual-clutch model of one shift of a twin, and its initial state."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin.export.input_delays import ACTING_INPUTS, InputDelays
from drivetwin.simulation.added_elements import (
    NO_ADDED_ELEMENTS,
    AddedElements,
    describe_added_elements,
)
from drivetwin.simulation.driveline_run import DrivelineTask
from drivetwin.simulation.dual_clutch import DualClutch, FloatArray, Signal, State
from drivetwin.twin.twin import Twin, build_nominal_shift

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
