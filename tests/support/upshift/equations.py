# SPDX-License-Identifier: MIT
"""The problem as a Python user writes it for a general solver: rates, guards, restarts."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import Enum

from tests.support.upshift.statement import STEP, Inputs, Problem, start

Guard = Callable[[float, Sequence[float]], float]


class Contact(Enum):
    """State of one clutch."""

    OPEN = "open"
    SLIP = "slip"
    STUCK = "stuck"


@dataclass(frozen=True)
class Clutch:
    """One clutch in its present state; `sense` is the sign of its slip."""

    number: int
    contact: Contact
    sense: float = 1.0


Mode = tuple[Clutch, Clutch]
FIRST_MODE: Mode = (Clutch(0, Contact.STUCK), Clutch(1, Contact.OPEN))


class Equations:
    """State: ω_e, ω_out, ω_w [rad/s] and the torque of the shaft's spring [N m]."""

    def __init__(self, of: Problem, given: Inputs) -> None:
        self.of = of
        self.start = start(of, given)
        self._inputs: list[list[float]] = [one.tolist() for one in (given.torque, *given.pressures)]
        self._rows = [(1.0 / (of.i_in * c), -o) for c, o in zip(of.i_c, of.i_out, strict=True)]
        self._yield = [a * a / of.J_e + b * b / of.J_out for a, b in self._rows]

    def input(self, which: int, t: float) -> float:
        """Engine torque (0) or a pressure (1, 2) at a time."""
        samples = self._inputs[which]
        place = min(int(t / STEP), len(samples) - 2)
        part = t / STEP - place
        return samples[place] + part * (samples[place + 1] - samples[place])

    def grip(self, number: int, t: float) -> float:
        """gain · (P - P0) of a clutch [N m]; negative where it is not filled."""
        return self.of.gain[number] * (self.input(number + 1, t) - self.of.P0[number])

    def slip(self, number: int, x: Sequence[float]) -> float:
        """Slip of a clutch [rad/s]."""
        a, b = self._rows[number]
        return a * x[0] + b * x[1]

    def shaft_torque(self, x: Sequence[float]) -> float:
        """T_o [N m]."""
        return x[3] + self.of.c * (x[1] - self.of.i_f * x[2])

    def evaluate(self, t: float, x: Sequence[float], mode: Mode) -> tuple[list[float], list[float]]:
        """Rates of the state and torques of the clutches."""
        of, shaft = self.of, self.shaft_torque(x)
        engine, output = of.eta * self.input(0, t), -shaft
        torques = [0.0, 0.0]
        for clutch in sorted(mode, key=lambda one: one.contact is Contact.STUCK):
            a, b = self._rows[clutch.number]
            torque = 0.0
            if clutch.contact is Contact.SLIP:
                torque = self._kinetic(clutch, t, x)
            elif clutch.contact is Contact.STUCK:
                pull = a * engine / of.J_e + b * output / of.J_out
                torque = pull / self._yield[clutch.number]
            torques[clutch.number] = torque
            engine, output = engine - a * torque, output - b * torque
        wheel = (shaft * of.i_f - of.T_v) / of.J_v
        spring = of.k * (x[1] - of.i_f * x[2])
        return [engine / of.J_e, output / of.J_out, wheel, spring], torques

    def guards(self, mode: Mode) -> list[tuple[Clutch, Guard]]:
        """Functions that fall through zero where a clutch leaves its state."""
        found: list[tuple[Clutch, Guard]] = []
        for clutch in mode:
            match clutch.contact:
                case Contact.OPEN:
                    found.append((clutch, self._filling(clutch, -1.0)))
                case Contact.SLIP:
                    found.append((clutch, self._slipping(clutch)))
                    found.append((replace(clutch, sense=0.0), self._filling(clutch, 1.0)))
                case Contact.STUCK:
                    for side in (1.0, -1.0):
                        leaving = replace(clutch, sense=side)
                        found.append((leaving, self._reserve(leaving, mode)))
        return found

    def after(
        self, t: float, x: Sequence[float], mode: Mode, fired: Clutch
    ) -> tuple[list[float], Mode]:
        """State and mode beyond an event of one clutch."""
        n = fired.number
        if fired.contact is Contact.SLIP and fired.sense == 0.0:
            return list(x), _with(mode, Clutch(n, Contact.OPEN))
        if fired.contact is Contact.STUCK:
            return list(x), _with(mode, Clutch(n, Contact.SLIP, fired.sense))
        if fired.contact is Contact.OPEN:
            sense = 1.0 if self.slip(n, x) >= 0.0 else -1.0
            return list(x), _with(mode, Clutch(n, Contact.SLIP, sense))
        held = _with(mode, Clutch(n, Contact.STUCK))
        if abs(self.evaluate(t, x, held)[1][n]) > self.of.mu_s * self.grip(n, t):
            return list(x), _with(mode, Clutch(n, Contact.SLIP, -fired.sense))
        rest = self.slip(n, x) / self._yield[n]
        a, b = self._rows[n]
        return [x[0] - a * rest / self.of.J_e, x[1] - b * rest / self.of.J_out, x[2], x[3]], held

    def _kinetic(self, clutch: Clutch, t: float, x: Sequence[float]) -> float:
        of, size = self.of, abs(self.slip(clutch.number, x))
        mu = of.mu_c + (of.mu_s - of.mu_c) * math.exp(-size / of.v_s) + of.mu_v * size
        return clutch.sense * mu * max(0.0, self.grip(clutch.number, t))

    def _filling(self, clutch: Clutch, sign: float) -> Guard:
        return lambda t, _x: sign * self.grip(clutch.number, t)

    def _slipping(self, clutch: Clutch) -> Guard:
        return lambda _t, x: clutch.sense * self.slip(clutch.number, x)

    def _reserve(self, clutch: Clutch, mode: Mode) -> Guard:
        def reserve(t: float, x: Sequence[float]) -> float:
            torque = self.evaluate(t, x, mode)[1][clutch.number]
            return self.of.mu_s * self.grip(clutch.number, t) - clutch.sense * torque

        return reserve


def _with(mode: Mode, changed: Clutch) -> Mode:
    return (changed, mode[1]) if changed.number == 0 else (mode[0], changed)
