# SPDX-License-Identifier: MIT
"""Driveline of a shift as a linear model with known locks (theory section 3); observed torques.

State x = (ω_e, ω_out, ω_w, twist, e, m_A, m_B, T_v): e is the error of the engine torque as read,
m the relative error of each element's torque while it slips, T_v the load at the wheel. In the
four phases of a shift the elements are locked, slipping or open, and

    M·v' = φ(T_e + e) - Gᵀ·T_slip·(1 + m) - shaft - load,   locked elements: no motion along slip

is linear in x. The torque of a slipping element (`base`) is either its friction law at the measured
pressure, or a constant level; m is then the relative deviation from this level.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin.estimation.result.estimate import Z95
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.dual_clutch import DualClutch, ShiftElement

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Band:
    """A torque [N m] and one standard deviation of its error, both (n,)."""

    value: FloatArray
    std: FloatArray

    @property
    def lower(self) -> FloatArray:
        """Lower end of the 95 % band."""
        return self.value - Z95 * self.std

    @property
    def upper(self) -> FloatArray:
        """Upper end of the 95 % band."""
        return self.value + Z95 * self.std


@dataclass(frozen=True, eq=False)
class Observation:
    """The torques of one shift on `time` (n,) [s].

    `output_torque` is T_o of the shaft, `clutch_torque` goes by element and has the sign of its
    slip where it slips (THEORY section 3). `notes` list missing inputs and cuts of the gears before
    and after the shift.
    """

    shift: Shift
    time: FloatArray
    output_torque: Band
    clutch_torque: Mapping[str, Band]
    notes: tuple[str, ...] = ()

    @property
    def bands(self) -> dict[str, Band]:
        """Torques by the name of their channel: `output_torque`, `torque.<element>`."""
        clutches = {f"torque.{name}": band for name, band in self.clutch_torque.items()}
        return {"output_torque": self.output_torque, **clutches}


BoolArray = NDArray[np.bool_]

STATES = 8
ENGINE, OUTPUT, WHEEL, TWIST, TORQUE_ERROR, CARRIED, LOAD = 0, 1, 2, 3, 4, 5, 7
"""Places in the state; CARRIED is that of the first element, the other follows."""
SPEEDS = 3


@dataclass(frozen=True, eq=False)
class Course:
    """Inputs over the grid `time` (N,), each over the N-1 steps between.

    `engine_torque` [N m] is corrected for its delay. `driving` is True if power flows from the
    engine, T_g ≥ 0. By element: `locked`; `base` [N m], the torque while it slips, with the sign of
    the slip and 0 while it is open; and `drift` [1/sqrt(s)], the lower bound of the drift of its
    relative error. `error_rate` [1/s] is the decay rate of the engine torque's error.
    """

    time: FloatArray
    engine_torque: FloatArray
    driving: BoolArray
    locked: Mapping[str, BoolArray]
    base: Mapping[str, FloatArray]
    drift: Mapping[str, FloatArray]
    error_rate: float


@dataclass(frozen=True, eq=False)
class Linear:
    """Discrete model: x_{k+1} = F_k·x_k + b_k with F (N-1, 8, 8), b (N-1, 8).

    An observed torque over step k is rows (N-1, 8)·x + constant (N-1,), by name. `drift` (N-1,) by
    element is as of the course, NaN where it carries nothing.
    """

    transition: FloatArray
    push: FloatArray
    rows: Mapping[str, FloatArray]
    constants: Mapping[str, FloatArray]
    drift: Mapping[str, FloatArray]


def compute_impulse_response(model: DualClutch, one: ShiftElement) -> tuple[FloatArray, FloatArray]:
    """Response of the three speeds (3,) to a unit impulse of an element, and its slip row (3,)."""
    g = _build_slip_row(model, one)
    mass = np.diag([model.J1 * model.eta + model.J2e, model.J_out, model.J_v])
    for each in model.elements:
        mass += each.drum_inertia * np.outer(
            _build_slip_row(model, each), _build_slip_row(model, each)
        )
    return np.asarray(np.linalg.solve(mass, g), dtype=np.float64), g


def build_linear_model(model: DualClutch, course: Course) -> Linear:
    """The model in its modes over the course."""
    step = np.diff(course.time)
    force, known = _compute_forces(model, course)
    inverse = _compute_inverse_mass(model, course)
    held = _compute_locking_rows(model, course, inverse)
    moving = inverse.copy()
    for one in model.elements:
        along = inverse @ _build_slip_row(model, one)
        moving -= along[:, :, None] * held[one.name][:, None, :]
    rate = np.zeros((step.size, STATES, STATES))
    rate[:, :SPEEDS, :] = moving @ force
    rate[:, TWIST, OUTPUT], rate[:, TWIST, WHEEL] = 1.0, -model.i_f
    rate[:, TORQUE_ERROR, TORQUE_ERROR] = -course.error_rate
    push = np.zeros((step.size, STATES))
    push[:, :SPEEDS] = np.einsum("kij,kj->ki", moving, known)
    transition, mean = _compute_exponentials(rate * step[:, None, None])
    shaft = np.zeros(STATES)
    shaft[:4] = _build_shaft_row(model)
    rows = {"output_torque": np.broadcast_to(shaft, (step.size, STATES))}
    constants = {"output_torque": np.zeros(step.size)}
    for place, one in enumerate(model.elements):
        row = np.einsum("kj,kji->ki", held[one.name], force)
        row[:, CARRIED + place] += course.base[one.name]
        rows[one.name] = row
        constants[one.name] = np.einsum("kj,kj->k", held[one.name], known) + course.base[one.name]
    pushed = np.einsum("kij,kj->ki", mean, push) * step[:, None]
    drift = {n: np.where(base != 0.0, course.drift[n], np.nan) for n, base in course.base.items()}
    return Linear(transition, pushed, rows, constants, drift)


def _build_shaft_row(model: DualClutch) -> FloatArray:
    """Torque of the output shaft as a row (4,) of speeds and twist."""
    return np.array([0.0, model.c_o, -model.c_o * model.i_f, model.k_o])


def _build_slip_row(model: DualClutch, one: ShiftElement) -> FloatArray:
    """Slip of an element, ω_in/i_c - i_out·ω_out (eq. 15), as a row (3,) of the speeds."""
    return np.array([1.0 / (model.i_in * one.i_c), -one.i_out, 0.0])


def _compute_efficiency(model: DualClutch, course: Course) -> FloatArray:
    """dφ/dT_g (N-1,), by the loss law."""
    ahead, back = (model.get_efficiency(driving=driving) for driving in (True, False))
    return np.where(course.driving, ahead, back)


def _compute_forces(model: DualClutch, course: Course) -> tuple[FloatArray, FloatArray]:
    """Forces on the three speeds without those of locked elements: (N-1, 3, 8)·x + (N-1, 3)."""
    count = course.engine_torque.size
    share = _compute_efficiency(model, course)
    force = np.zeros((count, SPEEDS, STATES))
    known = np.zeros((count, SPEEDS))
    shaft = _build_shaft_row(model)
    force[:, OUTPUT, :4] -= shaft
    force[:, WHEEL, :4] += model.i_f * shaft
    force[:, WHEEL, LOAD] = -1.0
    force[:, ENGINE, TORQUE_ERROR] = share
    known[:, ENGINE] = share * course.engine_torque
    for place, one in enumerate(model.elements):
        g, base = _build_slip_row(model, one), course.base[one.name]
        force[:, :, CARRIED + place] -= base[:, None] * g
        known -= base[:, None] * g
    return force, known


def _compute_inverse_mass(model: DualClutch, course: Course) -> FloatArray:
    """Accelerations per force (N-1, 3, 3) with no element locked."""
    share = _compute_efficiency(model, course)
    mass = np.zeros((share.size, SPEEDS, SPEEDS))
    mass[:, ENGINE, ENGINE] = model.J1 * share + model.J2e
    mass[:, OUTPUT, OUTPUT] = model.J_out
    mass[:, WHEEL, WHEEL] = model.J_v
    for one in model.elements:
        g = _build_slip_row(model, one)
        mass += one.drum_inertia * np.outer(g, g)
    return np.asarray(np.linalg.inv(mass), dtype=np.float64)


def _compute_locking_rows(
    model: DualClutch, course: Course, inverse: FloatArray
) -> dict[str, FloatArray]:
    """Row (N-1, 3) by element that gives its torque from all other forces while it is locked."""
    found = {}
    for one in model.elements:
        g = _build_slip_row(model, one)
        along = inverse @ g
        found[one.name] = course.locked[one.name][:, None] * along / (along @ g)[:, None]
    return found


_LEAST_DOUBLINGS = 3
"""Doublings after a Taylor series of fourth order [count]."""
_SAME = 1e-10
"""Difference of successive rates over their size that is rounding of the stamps."""


def _compute_exponentials(matrices: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute e^M and its mean over the step, ∫₀¹ e^(M·s) ds, of (n, m, m).

    Successive equal matrices share one computation: with all elements locked the rate is constant
    and its steps differ by the rounding of the stamps.
    """
    flat = np.abs(matrices.reshape(len(matrices), -1))
    changes = np.abs(np.diff(matrices.reshape(flat.shape), axis=0)).max(axis=1)
    # Written so that a number that is not finite begins a new run.
    starts = np.r_[True, ~(changes <= _SAME * flat[1:].max(axis=1))]
    size = float(np.abs(matrices[starts]).sum(axis=2).max())
    doublings = int(np.ceil(np.log2(max(size, 1.0)))) + 1 if np.isfinite(size) else 0
    found, mean = _compute_exponential(matrices[starts], max(doublings, _LEAST_DOUBLINGS))
    run = np.cumsum(starts) - 1
    return found[run], mean[run]


def _compute_exponential(matrix: FloatArray, doublings: int) -> tuple[FloatArray, FloatArray]:
    """Compute e^M and its mean over the step, ∫₀¹ e^(M·s) ds, of (n, m, m).

    Taylor's series of M over 2^`doublings`, doubled so many times.
    """
    term = matrix / 2.0**doublings
    identity = np.eye(matrix.shape[-1])
    result, mean, power = identity + term, identity + term / 2.0, term
    for order in (2, 3, 4):
        power = power @ term / order
        result = result + power
        mean = mean + power / (order + 1.0)
    for _ in range(doublings):
        mean = 0.5 * (result + identity) @ mean
        result = result @ result
    return np.asarray(result), np.asarray(mean)
