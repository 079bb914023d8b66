# SPDX-License-Identifier: MIT
"""The driveline as a linear system in one gear or phase: eigenfrequencies, frequency response.

In one friction mode the motion is linear but for μ(slip), the loads and maps; with μ and pressure
linearised about an operating point, what is left are four matrices.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin import _native
from drivetwin.driveline import DualClutch, FloatArray, as_json
from drivetwin.errors import InputError

Element = Mapping[str, object]
Output = tuple[str, str]
"""A quantity and the name of its node or element, such as ("shaft_torque", "output shaft")."""

SHAFT_TORQUE: Output = ("shaft_torque", "output shaft")


@dataclass(frozen=True)
class Slip:
    """Operating point of a slipping element: slip [rad/s], signed, and gauge pressure [Pa]."""

    slip: float
    pressure: float


@dataclass(frozen=True)
class Oscillation:
    """A pair of eigenvalues: damped frequency [Hz], damping ratio (negative: it grows)."""

    frequency: float
    damping: float


@dataclass(frozen=True)
class LinearSystem:
    """x' = A x + B u, y = C x + D u about an operating point; SI; names as the rows stand."""

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[Output, ...]

    def eigenvalues(self) -> NDArray[np.complex128]:
        """Eigenvalues of A [1/s], by magnitude."""
        values = np.asarray(np.linalg.eigvals(self.A), dtype=np.complex128)
        return np.asarray(values[np.argsort(np.abs(values), kind="stable")])

    def oscillations(self) -> tuple[Oscillation, ...]:
        """Modes that swing, by frequency."""
        values = self.eigenvalues()
        pairs = values[values.imag > 1e-9 * np.abs(values).max(initial=1.0)]
        found = [
            Oscillation(float(v.imag / (2 * np.pi)), float(-v.real / np.abs(v))) for v in pairs
        ]
        return tuple(sorted(found, key=lambda o: o.frequency))

    def frequency_response(self, frequency: FloatArray) -> NDArray[np.complex128]:
        """Exact response C (jω - A)⁻¹ B + D at `frequency` (n,) [Hz]: (n, outputs, inputs)."""
        omega = 2j * np.pi * np.asarray(frequency, dtype=np.float64)
        unit = np.eye(len(self.A))
        moved = omega[:, None, None] * unit - self.A
        return np.asarray(
            self.C @ np.linalg.solve(moved, np.broadcast_to(self.B, (len(omega), *self.B.shape)))
            + self.D
        )


def linearise(
    driveline: DualClutch | Sequence[Element],
    locked: Sequence[str],
    slipping: Mapping[str, Slip] | None = None,
    outputs: Sequence[Output] = (SHAFT_TORQUE,),
) -> LinearSystem:
    """Linearise with `locked` elements at rest, `slipping` ones at their points, all others open.

    Loads that depend on speed, maps and converters count as constant torques.
    Raises InputError for unknown names or an inconsistent description.
    """
    plain = asdict(driveline) if isinstance(driveline, DualClutch) else list(driveline)
    points = [(name, p.slip, p.pressure) for name, p in (slipping or {}).items()]
    wanted = json.dumps([{kind: name} for kind, name in outputs])
    try:
        matrices, states, inputs = _native.linearise(as_json(plain), list(locked), points, wanted)
    except ValueError as error:
        raise InputError(str(error), "correct the description or the names") from error
    a, b, c, d = matrices
    return LinearSystem(a, b, c, d, tuple(states), tuple(inputs), tuple(outputs))
