# SPDX-License-Identifier: MIT
"""Subject of an export: the dual-clutch model of one shift of a twin, and its initial state."""

from __future__ import annotations

from dataclasses import dataclass

from drivetwin.simulation.dual_clutch import DualClutch, State
from drivetwin.twin.nominal_shift import build_nominal_shift
from drivetwin.twin.twin import PRESSURE_DELAY, Twin

DEFAULT_ENGINE_SPEED = 150.0
"""Default engine speed [rad/s] at the start, for a twin without recorded speeds."""


@dataclass(frozen=True)
class InputDelays:
    """Delays [s] between the inputs of a log and those that act in the model.

    A log shows the engine torque `torque` after it acts. Pressures act `pressure` after the log
    shows them. Both may be negative.
    """

    torque: float = 0.0
    pressure: float = 0.0

    @classmethod
    def from_twin(cls, twin: Twin) -> InputDelays:
        """Return the identified delays of a twin."""
        return cls(twin.get_value("te_delay", 0.0), twin.get_value(PRESSURE_DELAY, 0.0))

    def describe_torque(self) -> str:
        """Describe how a logged engine torque becomes the input; empty without a delay."""
        return _describe_shift(-self.torque)

    def describe_pressure(self) -> str:
        """Describe how a logged pressure becomes the input; empty without a delay."""
        return _describe_shift(self.pressure)

    def describe(self) -> str:
        """Describe both in one line; empty without a delay."""
        parts = (("engine torque", self.describe_torque()), ("pressures", self.describe_pressure()))
        return "; ".join(f"{name} {text}" for name, text in parts if text)


def _describe_shift(late: float) -> str:
    """Describe an input that acts `late` [s] after the log shows it."""
    if late == 0.0:
        return ""
    way, side = ("delay", "after") if late > 0.0 else ("advance", "before")
    size = f"{abs(late):.5g} s"
    return f"as it acts, {size} {side} the log shows it: {way} the logged signal by {size}"


@dataclass(frozen=True)
class Subject:
    """A model with a name and a start; `elements` of the model are off-going, on-coming."""

    name: str
    model: DualClutch
    start: State
    note: str = ""
    """Origin of the numbers, one line."""
    delays: InputDelays = InputDelays()
    """Delays of the logged inputs behind those that the model takes."""


def build_subject(twin: Twin, gears: tuple[str, str] | None = None) -> Subject:
    """The model of the shift between two gears of a twin; by default its first upshift.

    It starts in the old gear at the mean engine speed of the twin's logs, without acceleration.
    Raises InputError for a shift that the twin does not have and for a plant with a part beside the
    dual clutch, MissingParameterError where a
    parameter that the simulation needs was not identified.
    """
    twin.require_dual_clutch("the export")
    shift = build_nominal_shift(twin, gears)
    model = twin.build_dual_clutch(shift)
    delays = InputDelays.from_twin(twin)
    return Subject(
        name=f"{twin.name} {shift.start_gear}-{shift.end_gear}",
        model=model,
        start=compute_steady_start(model, shift.offgoing, _compute_usual_speed(twin)),
        note=build_note(twin, delays),
        delays=delays,
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
