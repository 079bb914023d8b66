# SPDX-License-Identifier: MIT
"""Linear problems: inertias in a row on spring-dampers, one of them light.

They are stated twice, as elements of the core and as `x' = A x + b u(t)` for other programs. The
input is linear between samples at 1 kHz, so the exact motion follows from one matrix exponential.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from drivetwin.simulation.dual_clutch import FloatArray, Signal
from drivetwin.simulation.network import Element, Output, Start, build_element

TIME: FloatArray = np.linspace(0.0, 1.0, 1001)
TORQUE: FloatArray = 10.0 * np.sin(2.0 * np.pi * 5.0 * TIME)
"""Torque on the first inertia [N m]."""
STIFFNESS, DAMPING = 1e5, 10.0
"""Of every shaft, N m/rad and N m s/rad."""


@dataclass(frozen=True, eq=False)
class LinearProblem:
    """Inertias [kg m^2] in a row; `rate` gives the largest error of all speeds."""

    name: str
    inertias: tuple[float, ...]
    unit: ClassVar[str] = "rad/s"

    @property
    def elements(self) -> list[Element]:
        """Elements of the core."""
        count = len(self.inertias)
        return [
            *(
                build_element("inertia", f"J{i}", node=f"n{i}", inertia=self.inertias[i])
                for i in range(count)
            ),
            *(
                build_element(
                    *("spring_damper", f"s{i}"),
                    a=f"n{i}",
                    b=f"n{i + 1}",
                    stiffness=STIFFNESS,
                    damping=DAMPING,
                )
                for i in range(count - 1)
            ),
            build_element("torque", "T", node="n0", input="T"),
        ]

    @property
    def start(self) -> Start:
        """Standstill."""
        return Start({f"n{i}": 0.0 for i in range(len(self.inertias))})

    @property
    def inputs(self) -> dict[str, Signal]:
        """Torque by its samples."""
        return {"T": Signal(TIME, TORQUE)}

    @property
    def outputs(self) -> list[Output]:
        """All speeds."""
        return [("speed", f"n{i}") for i in range(len(self.inertias))]

    def build_system(self) -> tuple[FloatArray, FloatArray]:
        """Build A and b over the speeds and the twists times stiffness over damping.

        So scaled, all states are speeds [rad/s], and the squared exponential loses no digits.
        """
        count, masses = len(self.inertias), np.array(self.inertias)[:, None]
        turns = np.zeros((count - 1, count))
        turns[np.arange(count - 1), np.arange(count - 1)] = 1.0
        turns[np.arange(count - 1), np.arange(1, count)] = -1.0
        by_twist = -DAMPING * turns.T / masses
        A = np.zeros((2 * count - 1, 2 * count - 1))
        A[:count] = np.hstack([by_twist @ turns, by_twist])
        A[count:, :count] = STIFFNESS / DAMPING * turns
        b = np.zeros(len(A))
        b[0] = 1.0 / self.inertias[0]
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
        """Return the speeds (n, inertias), given the exponential of the augmented matrix over a
        step."""
        size, step = len(power) - 2, TIME[1] - TIME[0]
        x: NDArray[Any] = np.zeros(size, dtype=power.dtype)
        rows = [x]
        for now, then in pairwise(TORQUE):
            given = np.array([now, (then - now) / step], dtype=power.dtype)
            x = power[:size] @ np.concatenate([x, given])
            rows.append(x)
        return np.array(rows)[:, : len(self.inertias)].astype(np.float64)

    @cached_property
    def exact(self) -> FloatArray:
        """Speeds (n, inertias) by a matrix exponential in long double."""
        step = np.longdouble(TIME[1] - TIME[0])
        return self.march(_exponential(self.augment().astype(np.longdouble) * step))

    def rate(self, speeds: FloatArray) -> float:
        """Return the largest error of speeds (n, inertias)."""
        return float(np.abs(speeds - self.exact).max())


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


STIFF = LinearProblem("stiff", (1.0, 1e-6, 1.0))
CHAIN = LinearProblem("chain", tuple(np.geomspace(10.0, 1e-7, 20).tolist()))
