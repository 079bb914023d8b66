# SPDX-License-Identifier: MIT
"""The driveline as a linear system in one gear or phase: eigenfrequencies, frequency response.

In one friction mode the motion is linear but for μ(slip), the loads and maps; with μ and pressure
linearised about an operating point and the rest held, what is left are four matrices.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import null_space

from drivetwin._native import linearise as native_linearise
from drivetwin.errors import InputError
from drivetwin.simulation.added_elements import AddedElements, InputShaft, OpenConverter
from drivetwin.simulation.driveline import SHAFT, build_driveline
from drivetwin.simulation.dual_clutch import DualClutch, FloatArray
from drivetwin.simulation.element_schema import (
    as_json,
    as_names,
    find_element_faults,
    refuse_faults,
    require_number,
)
from drivetwin.simulation.network import Element, Request, combine_columns, resolve_output

Output = tuple[str, str]
"""A quantity and the name of its node or element, such as ("shaft_torque", "output shaft")."""

SHAFT_TORQUE: Output = ("shaft_torque", SHAFT)

_ZERO = 1e-12
"""Relative size of numbers that are zero but for round-off."""

_STILL = 1e-9
"""Eigenvalue over the largest one below which it is that of a free motion."""

_HELD = {"prescribed_speed": "input", "engine_map": "throttle"}
"""Elements that take no part in a linear system, and their field that names the input."""


@dataclass(frozen=True)
class Slip:
    """Operating point of a slipping element: slip [rad/s], signed, and gauge pressure [Pa].

    At zero slip the element is taken to move forward.
    Raises InputError where one of them is not finite.
    """

    slip: float
    pressure: float

    def __post_init__(self) -> None:
        if not (math.isfinite(self.slip) and math.isfinite(self.pressure)):
            raise InputError(f"{self} is no operating point", "give finite numbers")


@dataclass(frozen=True)
class Oscillation:
    """A pair of eigenvalues: damped frequency [Hz], damping ratio (negative: it grows)."""

    frequency: float
    damping: float


@dataclass(frozen=True, eq=False)
class LinearSystem:
    """x' = A x + B u, y = C x + D u about an operating point; SI; names as the rows stand."""

    A: FloatArray
    B: FloatArray
    C: FloatArray
    D: FloatArray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[Output, ...]

    def compute_eigenvalues(self) -> NDArray[np.complex128]:
        """Eigenvalues of A [1/s], by magnitude."""
        values = np.asarray(np.linalg.eigvals(self.A), dtype=np.complex128)
        return np.asarray(values[np.argsort(np.abs(values), kind="stable")])

    def find_oscillations(self) -> tuple[Oscillation, ...]:
        """Modes that swing, by frequency; what is critically damped to 1e-12 does not."""
        values = self.compute_eigenvalues()
        sizes = np.abs(values)
        # Round-off parts the two equal eigenvalues of critical damping by its square root.
        pairs = values[values.imag > np.maximum(1e-6 * sizes, _STILL * sizes.max(initial=1.0))]
        found = [
            Oscillation(float(v.imag / (2 * np.pi)), float(-v.real / np.abs(v))) for v in pairs
        ]
        return tuple(sorted(found, key=lambda o: o.frequency))

    def compute_frequency_response(self, frequency: FloatArray) -> NDArray[np.complex128]:
        """Exact response C (jω - A)⁻¹ B + D at `frequency` (n,) [Hz]: (n, outputs, inputs).

        States that no input moves, as the slip of a locked element, stay as they are.
        Raises InputError where a frequency is an eigenvalue of what moves, such as 0 of a driveline
        that turns freely: a motion there grows without end.
        """
        omega = 2j * np.pi * np.atleast_1d(np.asarray(frequency, dtype=np.float64))
        moved = omega[:, None, None] * np.eye(len(self.A)) - self.A
        try:
            states = np.linalg.solve(moved, np.broadcast_to(self.B, (len(omega), *self.B.shape)))
        except np.linalg.LinAlgError:
            states = np.stack([_solve_forced_states(one, self.B) for one in moved])
        return np.asarray(self.C @ states + self.D)


def _solve_forced_states(moved: NDArray[np.complex128], by: FloatArray) -> NDArray[np.complex128]:
    """States X (n, inputs) of `moved` X = `by`, zero in every combination that no input moves.

    Such a combination w has w·`moved` = 0 and w·`by` = 0: the slip of a locked element, or the
    difference of the twists of two shafts side by side. Rows and columns are brought to one size,
    so that the zero test does not depend on units. Raises InputError where X is not unique even so.
    """
    rows = 1.0 / _compute_sizes(np.hstack([moved, by]), 1)
    forces = rows * by
    columns = 1.0 / _compute_sizes(rows * moved, 0)
    scaled = rows * moved * columns
    every = np.hstack([scaled, forces / _compute_sizes(forces, 0)])
    still = null_space(every.conj().T, rcond=_ZERO).conj().T
    held = still * rows.T * columns
    whole = np.vstack([scaled, held / _compute_sizes(held, 1)])
    silent = np.zeros((len(held), by.shape[1]))
    found, _, rank, _ = np.linalg.lstsq(whole, np.vstack([forces, silent]), rcond=_ZERO)
    if rank < len(moved):
        raise InputError(
            "one of the frequencies is an eigenvalue: there is no response to it",
            "leave it out; 0 Hz is an eigenvalue of a driveline that turns freely",
        )
    return np.asarray(columns.T * found)


def _compute_sizes(matrix: NDArray[np.complex128] | FloatArray, axis: int) -> FloatArray:
    """Largest magnitude along an axis, which is kept; 1 where all are zero."""
    largest = np.abs(matrix).max(axis=axis, keepdims=True, initial=0.0)
    return np.where(largest > 0.0, largest, 1.0)


def linearise(
    driveline: DualClutch | Sequence[Element],
    locked: Sequence[str],
    slipping: Mapping[str, Slip] | None = None,
    outputs: Sequence[Output] | None = None,
) -> LinearSystem:
    """Linearise with `locked` elements at rest, `slipping` ones at their points, all others open.

    `outputs` are by default the shaft torque of a dual clutch and nothing of a network; an angle is
    none, since it is the integral of a speed. Loads that depend on speed, maps and converters count
    as constant torques, speeds stay as prescribed, and their inputs are left out; backlash is in
    its play; gears with loss pass power from `a` to `b`.
    Raises InputError for unknown names or an inconsistent description.
    """
    if isinstance(driveline, DualClutch):
        elements = build_driveline(driveline)
        outputs = (SHAFT_TORQUE,) if outputs is None else outputs
    else:
        elements, outputs = list(driveline), outputs or ()
    locked, points = as_names(locked), dict(slipping or {})
    refuse_faults(find_element_faults(elements))
    _check(locked, points)
    requests = _find_requests(outputs, elements)
    try:
        matrices, states, inputs = native_linearise(
            as_json(elements),
            locked,
            [
                (
                    name,
                    require_number(f"slip of {name!r}", p.slip, finite=False),
                    require_number(f"pressure of {name!r}", p.pressure, finite=False),
                )
                for name, p in points.items()
            ],
            [one for request in requests for one in request.native],
        )
    except ValueError as error:
        raise InputError(str(error), "correct the description or the names") from error
    a, b, c, d = matrices
    held = _collect_inactive_inputs(elements)
    moving = [i for i, name in enumerate(inputs) if name not in held]
    rows = combine_columns(requests, np.hstack([c, d]))
    by_all = np.reshape(rows, (len(outputs), len(states) + len(inputs)))
    by_states, by_inputs = np.hsplit(by_all, [len(states)])
    return LinearSystem(
        a,
        b[:, moving],
        by_states,
        by_inputs[:, moving],
        tuple(states),
        tuple(inputs[i] for i in moving),
        tuple(outputs),
    )


def compute_lockup_oscillation(
    model: DualClutch, locked: str, front: InputShaft | OpenConverter | None = None
) -> Oscillation:
    """Compute the oscillation after lock-up: the slowest mode with the element `locked`.

    Without an input shaft in `front` of the gearbox it is that of eqs. 12-14 of the paper. An open
    converter in front leaves J1, the turbine's inertia, to swing. Where nothing swings, the
    frequency is 0 and the damping ratio that of the two slowest decays.
    """
    system = linearise(build_driveline(model, AddedElements(front=front)), [locked])
    found = system.find_oscillations()
    if found:
        return found[0]
    rates = np.abs(system.compute_eigenvalues())
    one, other = rates[rates > _STILL * rates[-1]][:2]
    return Oscillation(0.0, float((one + other) / (2.0 * np.sqrt(one * other))))


def find_fastest_rate(elements: Sequence[Element], locked: Sequence[str]) -> float:
    """Find the largest magnitude of an eigenvalue [1/s], with plays in contact.

    It is 0 where nothing moves. Raises InputError as `linearise` does.
    """
    closed = [
        {key: one[key] for key in one if key != "gap"} | {"type": "spring_damper"}
        if one["type"] == "backlash"
        else one
        for one in elements
    ]
    values = linearise(closed, locked).compute_eigenvalues()
    return float(np.abs(values).max(initial=0.0))


def _check(locked: Sequence[str], points: Mapping[str, Slip]) -> None:
    """Raise InputError for an element that is both locked and slipping."""
    both = [name for name in points if name in locked]
    if both:
        raise InputError(f"{', '.join(both)}: locked and slipping", "name it in one of them")


def _find_requests(outputs: Sequence[Output], elements: Sequence[Element]) -> list[Request]:
    """Resolve the outputs. Raises InputError for those that a linear system cannot represent."""
    requests = [resolve_output(output, elements) for output in outputs]
    refuse_faults([one for one in requests if isinstance(one, str)])
    angles = [name for kind, name in outputs if kind == "angle"]
    if angles:
        raise InputError(
            f"the angle of {', '.join(angles)} is no output of a linear system",
            "ask for the speed; the response of the angle is that of the speed over jω",
        )
    return [one for one in requests if isinstance(one, Request)]


def _collect_inactive_inputs(elements: Sequence[Element]) -> set[object]:
    """Names of the inputs of elements that are not part of the linear system."""
    fields = [(one, _HELD.get(str(one.get("type")))) for one in elements]
    return {one.get(field) for one, field in fields if field}
