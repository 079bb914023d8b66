# SPDX-License-Identifier: MIT
"""The problems: inertias in a row on spring-dampers, one of them light or without mass.

They are stated twice, as elements of the core and as `x' = A x + b u(t)` for other programs. The
input is linear between samples at 1 kHz, so the exact motion follows from one matrix exponential.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from drivetwin.simulation.dual_clutch import FloatArray, Signal
from drivetwin.simulation.network import Element, Start, build_element

TIME: FloatArray = np.linspace(0.0, 1.0, 1001)
TORQUE: FloatArray = 10.0 * np.sin(2.0 * np.pi * 5.0 * TIME)
"""Torque on the first inertia [N m]."""
STIFFNESS, DAMPING = 1e5, 10.0
"""Of every shaft, N m/rad and N m s/rad."""


@dataclass(frozen=True, eq=False)
class Problem:
    """Inertias [kg m^2] in a row; those of zero are not stated in the elements."""

    name: str
    inertias: tuple[float, ...]

    @property
    def elements(self) -> list[Element]:
        """Elements of the core."""
        shafts = range(len(self.inertias) - 1)
        return [
            *(
                build_element("inertia", f"J{i}", node=f"n{i}", inertia=inertia)
                for i, inertia in enumerate(self.inertias)
                if inertia > 0.0
            ),
            *(
                build_element(
                    *("spring_damper", f"s{i}"),
                    a=f"n{i}",
                    b=f"n{i + 1}",
                    stiffness=STIFFNESS,
                    damping=DAMPING,
                )
                for i in shafts
            ),
            build_element("torque", "T", node="n0", input="T"),
        ]

    @property
    def start(self) -> Start:
        """Standstill."""
        return Start({f"n{i}": 0.0 for i, inertia in enumerate(self.inertias) if inertia > 0.0})

    @property
    def inputs(self) -> dict[str, Signal]:
        """Torque by its samples."""
        return {"T": Signal(TIME, TORQUE)}

    @property
    def heavy(self) -> list[int]:
        """Places with an inertia."""
        return [i for i, inertia in enumerate(self.inertias) if inertia > 0.0]

    def build_system(self) -> tuple[FloatArray, FloatArray]:
        """Build A and b over the speeds with inertia and the twists times stiffness over damping.

        So scaled, all states are speeds [rad/s], and the squared exponential loses no digits.
        The speed of a place without one follows from the torques there, which vanish in sum.
        """
        count = len(self.inertias)
        heavy, light = self.heavy, [i for i in range(count) if self.inertias[i] == 0.0]
        turns = np.zeros((count - 1, count))
        turns[np.arange(count - 1), np.arange(count - 1)] = 1.0
        turns[np.arange(count - 1), np.arange(1, count)] = -1.0
        # Torques on the places over speeds and twists.
        by_speed, by_twist = -DAMPING * turns.T @ turns, -DAMPING * turns.T
        speeds = np.zeros((count, len(heavy) + count - 1))
        speeds[heavy, np.arange(len(heavy))] = 1.0
        if light:
            given = by_speed[np.ix_(light, range(count))] @ speeds
            given[:, len(heavy) :] += by_twist[light]
            speeds[light] = -np.linalg.solve(by_speed[np.ix_(light, light)], given)
        torques = by_speed @ speeds
        torques[:, len(heavy) :] += by_twist
        masses = np.array([self.inertias[i] for i in heavy])
        A = np.vstack([torques[heavy] / masses[:, None], STIFFNESS / DAMPING * turns @ speeds])
        b = np.zeros(len(A))
        b[0] = 1.0 / masses[0]
        return A, b

    def augment(self) -> FloatArray:
        """Build the square matrix over the states, the torque and its slope, whose exponential
        over a step is exact for a torque that is linear in it (Van Loan 1978)."""
        A, b = self.build_system()
        size = len(A)
        whole = np.zeros((size + 2, size + 2))
        whole[:size, :size], whole[:size, size], whole[size, size + 1] = A, b, 1.0
        return whole

    def march(self, power: NDArray[Any]) -> FloatArray:
        """Return the speeds with inertia (n, places), given the exponential of the augmented matrix
        over a step."""
        size, step = len(power) - 2, TIME[1] - TIME[0]
        x: NDArray[Any] = np.zeros(size, dtype=power.dtype)
        rows = [x]
        for now, then in pairwise(TORQUE):
            given = np.array([now, (then - now) / step], dtype=power.dtype)
            x = power[:size] @ np.concatenate([x, given])
            rows.append(x)
        return np.array(rows)[:, : len(self.heavy)].astype(np.float64)

    def solve_exactly(self) -> FloatArray:
        """Return the speeds with inertia (n, places) by a matrix exponential in long double."""
        step = np.longdouble(TIME[1] - TIME[0])
        return self.march(_exponential(self.augment().astype(np.longdouble) * step))


def _exponential(matrix: NDArray[np.longdouble]) -> NDArray[np.longdouble]:
    """Return e^matrix by a Taylor series of the scaled matrix, squared again."""
    halvings = max(0, int(np.ceil(np.log2(float(np.abs(matrix).sum(axis=1).max())))) + 2)
    scaled = np.asarray(matrix / np.longdouble(2.0) ** halvings, dtype=np.longdouble)
    term: NDArray[np.longdouble] = np.eye(len(matrix), dtype=np.longdouble)
    total = term.copy()
    for order in range(1, 20):
        term = np.asarray(term @ scaled / order, dtype=np.longdouble)
        total += term
    for _ in range(halvings):
        total = total @ total
    return total


PROBLEMS = (
    Problem("1, 1e-6 and 1 kg·m²", (1.0, 1e-6, 1.0)),
    Problem("1, 1e-8 and 1 kg·m²", (1.0, 1e-8, 1.0)),
    Problem("1, 0 and 1 kg·m²", (1.0, 0.0, 1.0)),
    Problem("20 inertias from 10 down to 1e-7 kg·m²", tuple(np.geomspace(10.0, 1e-7, 20).tolist())),
)
