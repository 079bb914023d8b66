# SPDX-License-Identifier: MIT
"""Linear response of a shift to small disturbances of its inputs (THEORY section 3, linearised).

State z = (ω_e, ω_out, ω_w, twist). In one friction mode

    z' = A·z + Σ B_u·δu,   u: engine torque and pressures

A locked element takes the motion along its slip out of the accelerations. When an element locks,
the disturbance jumps so that its slip ends (saltation), and with it what pushed during that step:
a slip left over would stay and seem to be seen. At break-away it goes on unchanged.
Only the spread of the residuals is built on this: the run itself and its derivatives are the
core's.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.data.shift_record import TORQUE, ShiftRecord
from drivetwin.estimation.likelihood.noise.residual_covariance import LinearResponse
from drivetwin.simulation.dual_clutch import DualClutch, ShiftElement, Trajectory

BoolArray = NDArray[np.bool_]

STATES = 4
_LEAST_DOUBLINGS = 3
"""Doublings after a Taylor series of fourth order [count]."""
_SAME = 1e-10
"""Difference of successive rates over their size that is rounding of the stamps."""


@dataclass(frozen=True, eq=False)
class ShiftResponse(LinearResponse):
    """Response of the four states; `effect` (N-1, 4, 4) is that of forces on the speeds, whatever
    makes them."""

    effect: FloatArray

    def apply_torque_feedback(self, slope: FloatArray) -> ShiftResponse:
        """The response where the engine torque follows the engine speed by `slope` (N-1,)
        [N m s/rad], over each step by the mean of the speed at both its ends."""
        half = 0.5 * slope[:, None] * self.drive[TORQUE]
        transition = self.transition.copy()
        transition[:, :, 0] += half
        ahead = np.zeros_like(transition) + np.eye(STATES)
        ahead[:, :, 0] += half / (1.0 - half[:, :1])  # the inverse of 1 less the half at the end
        drive = {name: np.einsum("kij,kj->ki", ahead, one) for name, one in self.drive.items()}
        return replace(self, transition=ahead @ transition, drive=drive, effect=ahead @ self.effect)


@dataclass(frozen=True, eq=False)
class LinearRates:
    """Continuous-time linearisation over the N-1 steps of a run.

    `rate` (N-1, 4, 4) is A, `inverse` (N-1, 4, 4) the accelerations per force on the speeds,
    `force` (N-1, 4) by input name the force of that input's disturbance.
    """

    rate: FloatArray
    inverse: FloatArray
    force: dict[str, FloatArray]


def compute_rates(model: DualClutch, run: Trajectory, record: ShiftRecord) -> LinearRates:
    """Linearise the driveline of `model` around `run` over each of its steps."""
    time = run.time
    middle = 0.5 * (time[1:] + time[:-1])
    locked = {one.name: _find_locked(run, one.name, middle) for one in model.elements}
    driving = _find_driving(model, run)
    free = np.zeros((middle.size, STATES, STATES))
    free += _build_shaft_matrix(model)
    torque = np.zeros((middle.size, STATES))
    for way, inside in _iterate_directions(driving):
        torque[inside, 0] = model.get_efficiency(driving=way)
    force = {TORQUE: torque}
    for one in model.elements:
        if one.name not in record.pressures:
            continue
        signal = record.pressures[one.name]
        pressure = np.interp(middle, signal.time, signal.values)
        slip = 0.5 * (run.slip[one.name][1:] + run.slip[one.name][:-1])
        stiffness, gain = _linearise_friction(one, slip, pressure)
        sliding = ~locked[one.name]
        g = build_slip_row(model, one)
        free -= (stiffness * sliding)[:, None, None] * np.outer(g, g)
        force[one.name] = -(gain * sliding)[:, None] * g
    inverse = _build_acceleration(model, locked, driving)
    rate = inverse @ free
    rate[:, 3] = (0.0, 1.0, -model.i_f, 0.0)
    return LinearRates(rate, inverse, force)


def linearise_run(model: DualClutch, run: Trajectory, record: ShiftRecord) -> ShiftResponse:
    """Linearise around `run`, simulated on the record's grid."""
    step = np.diff(run.time)
    rates = compute_rates(model, run, record)
    with np.errstate(over="ignore", invalid="ignore"):
        transition, mean = compute_exponentials(rates.rate * step[:, None, None])
    effect = mean @ rates.inverse * step[:, None, None]
    for k, jump in iterate_jumps(model, run):
        transition[k], effect[k] = jump @ transition[k], jump @ effect[k]
    drive = {name: np.einsum("kij,kj->ki", effect, f) for name, f in rates.force.items()}
    return ShiftResponse(step, transition, drive, effect)


def build_output_row(model: DualClutch, name: str) -> FloatArray:
    """Row (4,) that gives a compared signal from the state."""
    rows = {
        "output_torque": (0.0, model.c_o, -model.c_o * model.i_f, model.k_o),
        "engine_speed": (1.0, 0.0, 0.0, 0.0),
        "output_speed": (0.0, 1.0, 0.0, 0.0),
        "wheel_speed": (0.0, 0.0, 1.0, 0.0),
    }
    return np.array(rows[name])


def compute_exponentials(matrices: FloatArray) -> tuple[FloatArray, FloatArray]:
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
    found, mean = compute_exponential(matrices[starts], max(doublings, _LEAST_DOUBLINGS))
    run = np.cumsum(starts) - 1
    return found[run], mean[run]


def compute_exponential(matrix: FloatArray, doublings: int) -> tuple[FloatArray, FloatArray]:
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


def build_slip_row(model: DualClutch, one: ShiftElement) -> FloatArray:
    """Slip of an element as a row (4,) of the state: ω_in/i_c - i_out·ω_out (eq. 15)."""
    return np.array([1.0 / (model.i_in * one.i_c), -one.i_out, 0.0, 0.0])


def _build_shaft_matrix(model: DualClutch) -> FloatArray:
    """Forces (4, 4) of the shaft on (ω_e, ω_out, ω_w): -T_o on the output, i_f·T_o at the wheel."""
    return np.outer([0.0, -1.0, model.i_f, 0.0], build_output_row(model, "output_torque"))


def _linearise_friction(
    one: ShiftElement, slip: FloatArray, pressure: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Derivatives of the sliding torque by slip and by pressure, (n,) each."""
    above = np.maximum(pressure - one.P0, 0.0) * one.gain
    mu = one.friction.evaluate(slip)
    small = 1e-3
    bend = (one.friction.evaluate(np.abs(slip) + small) - mu) / small
    return bend * above, mu * one.gain * np.sign(slip) * (above > 0.0)


def _find_locked(run: Trajectory, name: str, middle: FloatArray) -> BoolArray:
    """Return a mask (n,) of the instants `middle` (n,) at which the element is locked."""
    state = np.abs(run.slip[name][0]) < 1e-9
    result = np.full(middle.size, state)
    for event in run.events:
        if event.element == name and event.kind in ("lock", "break_away"):
            result[middle > event.time] = event.kind == "lock"
    return result


def _find_driving(model: DualClutch, run: Trajectory) -> BoolArray:
    """Return a mask (N-1,) of the steps in which power flows from the engine (two-sided loss law).

    φ(T_g) is what the input side and the elements take; its sign is that of T_g.
    """
    step = np.diff(run.time)
    taken = model.J2e * np.diff(run.engine_speed) / step
    for one in model.elements:
        torque, slip = run.clutch_torque[one.name], run.slip[one.name]
        carried = 0.5 * (torque[1:] + torque[:-1]) + one.drum_inertia * np.diff(slip) / step
        taken += build_slip_row(model, one)[0] * carried
    return np.asarray(taken >= 0.0)


def _iterate_directions(
    driving: BoolArray,
) -> tuple[tuple[bool, BoolArray], tuple[bool, BoolArray]]:
    """Both ways of the power, and where (n,) it flows so."""
    return (True, driving), (False, ~driving)


def _invert_mass(model: DualClutch, driving: bool) -> FloatArray:
    """Accelerations per force (4, 4) with no element locked."""
    engine = model.J1 * model.get_efficiency(driving=driving) + model.J2e
    mass = np.diag([engine, model.J_out, model.J_v, 1.0])
    for one in model.elements:
        g = build_slip_row(model, one)
        mass += one.drum_inertia * np.outer(g, g)
    inverse = np.asarray(np.linalg.inv(mass), dtype=np.float64)
    inverse[3] = 0.0
    return inverse


def _build_acceleration(
    model: DualClutch, locked: dict[str, BoolArray], driving: BoolArray
) -> FloatArray:
    """Accelerations per force (n, 4, 4), without those along the slip of locked elements."""
    result = np.empty((driving.size, STATES, STATES))
    for way, inside in _iterate_directions(driving):
        inverse = _invert_mass(model, way)
        result[inside] = inverse
        for one in model.elements:
            g = build_slip_row(model, one)
            along = inverse @ g
            result[inside & locked[one.name]] -= np.outer(along, along) / (g @ along)
    return result


def iterate_jumps(model: DualClutch, run: Trajectory) -> Iterator[tuple[int, FloatArray]]:
    """Yield (step, saltation (4, 4)) of every lock: z moves by the change of acceleration times
    δt."""
    driving = _find_driving(model, run)
    for event in run.events:
        if event.kind != "lock":
            continue
        one = next(e for e in model.elements if e.name == event.element)
        g = build_slip_row(model, one)
        k = int(np.searchsorted(run.time, event.time)) - 1
        if 0 <= k < run.time.size - 1:
            along = _invert_mass(model, bool(driving[k])) @ g
            yield k, np.eye(STATES) - np.outer(along, g) / (g @ along)
