# SPDX-License-Identifier: MIT
"""The equations of the shift for general integrators, with their rates compiled by Numba."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numba import njit

from benchmarks.precision.shift import ShiftProblem
from tests.support.upshift.equations import Contact, Equations, Mode

_CONTACTS = {Contact.OPEN: 0, Contact.SLIP: 1, Contact.STUCK: 2}


@njit(cache=False)
def evaluate(t, x, n, U, contacts, senses):  # type: ignore[no-untyped-def]
    """Rates of the shift and torques of the clutches; numbers as those of the C program."""
    k = min(int(t * 1e3), len(U) - 2)
    u = U[k] + (t * 1e3 - k) * (U[k + 1] - U[k])
    shaft = x[3] + n[12] * (x[1] - n[9] * x[2])
    engine, output, torques = u[0] * n[3], -shaft, np.zeros(2)
    for kind in (1, 2):
        for c in range(2):
            a, b = 1.0 / (n[4] * n[5 + 2 * c]), -n[6 + 2 * c]
            if contacts[c] == kind == 1:
                s = abs(a * x[0] + b * x[1])
                mu = n[18] + (n[17] - n[18]) * math.exp(-s / n[19]) + n[20] * s
                torques[c] = senses[c] * mu * n[13 + c] * max(0.0, u[1 + c] - n[15 + c])
            elif contacts[c] == kind:
                pull = a * engine / n[0] + b * output / n[1]
                torques[c] = pull / (a * a / n[0] + b * b / n[1])
            if contacts[c] == kind:
                engine, output = engine - a * torques[c], output - b * torques[c]
    wheel, spring = (shaft * n[9] - n[10]) / n[2], n[11] * (x[1] - n[9] * x[2])
    return np.array([engine / n[0], output / n[1], wheel, spring]), torques


class CompiledEquations(Equations):
    """The equations of the shift with their rates compiled."""

    def __init__(self, problem: ShiftProblem) -> None:
        super().__init__(problem.of, problem.given)
        self._numbers, _, self._samples = problem.numbers

    def evaluate(self, t: float, x: Sequence[float], mode: Mode) -> tuple[Any, Any]:
        """Rates of the state and torques of the clutches."""
        contacts, senses = zip(*((_CONTACTS[c.contact], c.sense) for c in mode), strict=True)
        found: tuple[Any, Any] = evaluate(
            t, np.asarray(x), self._numbers, self._samples, contacts, senses
        )
        return found
