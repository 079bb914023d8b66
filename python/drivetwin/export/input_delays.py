# SPDX-License-Identifier: MIT
"""Delays between the inputs of a log and the acting inputs of the exported model."""

from __future__ import annotations

from dataclasses import dataclass

from drivetwin.twin.twin import PRESSURE_DELAY, Twin


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
