# SPDX-License-Identifier: MIT
"""SciPy solution, from the equations in the README of this folder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from reference.march import Array
from reference.mechanism import Mechanism, Observation, solve, speed, state
from reference.tables import Solution

J_1, ETA, J_OUT, I_F, J_V = 20.3, 0.85, 0.9, 5.38, 6056.0
STIFFNESS, DAMPING, LOAD = 1.76e5, 280.0, 2300.0 * 5.38
RATIOS, GAINS, P_0 = (1.91, 1.43), (0.0378, 0.027), 80e3
ROWS = np.array([[1.0 / (i - 1.0), -i / (i - 1.0), 0.0] for i in RATIOS])


@dataclass(frozen=True)
class Line:
    """An input, linear between points."""

    times: Sequence[float]
    values: Sequence[float]

    def __call__(self, t: float) -> float:
        return float(np.interp(t, self.times, self.values))

    def crossings(self, level: float) -> list[float]:
        """Times at which the value passes a level."""
        above = np.sign(np.array(self.values) - level)
        return [
            self.times[i]
            + (level - self.values[i])
            / (self.values[i + 1] - self.values[i])
            * (self.times[i + 1] - self.times[i])
            for i in range(len(self.times) - 1)
            if above[i] * above[i + 1] < 0.0
        ]


def _shaft(v: Array, z: Array) -> float:
    return float(STIFFNESS * z[0] + DAMPING * (v[1] - I_F * v[2]))


def _mu(slip: Array) -> Array:
    return 0.110 + (0.135 - 0.110) * np.exp(-slip / 15.0) + 1e-4 * slip


def driveline(engine: Line, pressures: tuple[Line, Line]) -> Mechanism:
    """The mechanism under given engine torque and pressures."""

    def force(t: float, v: Array, z: Array) -> list[float]:
        shaft = _shaft(v, z)
        return [ETA * engine(t), -shaft, I_F * shaft - LOAD]

    def capacity(t: float, slip: Array) -> list[float]:
        effective = np.array([max(0.0, pressure(t) - P_0) for pressure in pressures])
        return list(_mu(slip) * GAINS * effective)

    knots = {0.0, *engine.times}
    for pressure in pressures:
        knots |= {*pressure.times, *pressure.crossings(P_0)}
    output = 178.0 / 1.91
    return Mechanism(
        mass=np.diag([J_1 * ETA, J_OUT, J_V]),
        force=force,
        elements=("B2", "B3"),
        rows=ROWS,
        capacity=capacity,
        knots=tuple(sorted(knots)),
        rest=lambda _t, v, _z: [v[1] - I_F * v[2]],
        start=((178.0, output, output / I_F), (2460.0 / STIFFNESS,)),
    )


OUTPUTS: dict[tuple[str, str], Observation] = {
    ("speed", "engine"): speed(1.0, 0.0, 0.0),
    ("speed", "output"): speed(0.0, 1.0, 0.0),
    ("speed", "wheel"): speed(0.0, 0.0, 1.0),
    ("twist", "shaft"): state(0),
    ("shaft_torque", "shaft"): lambda _t, v, z, _torque: _shaft(v, z),
}


def solution(time: Array) -> Solution:
    """Speeds, twist and shaft torque at `time` (n,) [s]."""
    engine = Line(
        (0.0, 0.45, 0.55, 0.80, 0.95, 1.4), (1545.0, 1545.0, 900.0, 900.0, 1545.0, 1545.0)
    )
    b2 = Line((0.0, 0.28, 0.30, 0.42, 1.4), (14e5, 14e5, 4.5e5, 0.0, 0.0))
    b3 = Line(
        (0.0, 0.10, 0.15, 0.28, 0.44, 0.75, 1.0, 1.4),
        (0.0, 0.0, 1.0e5, 1.0e5, 5.2e5, 4.6e5, 12e5, 12e5),
    )
    return solve(driveline(engine, (b2, b3)), time, OUTPUTS)
