# SPDX-License-Identifier: MIT
"""Linear model of the driveline of a shift with known locks (theory section 3), and its inputs.

State x = (ω_e, ω_out, ω_w, twist, e, m_A, m_B, T_v): e is the error of the engine torque as read,
m the relative error of each element's torque while it slips, T_v the load at the wheel. In the
four phases of a shift the elements are locked, slipping or open, and

    M·v' = φ(T_e + e) - Gᵀ·T_slip·(1 + m) - shaft - load,   locked elements: no motion along slip

is linear in x. The torque of a slipping element (`base`) is either its friction law at the measured
pressure, or a constant level; m is then the relative deviation from this level.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from drivetwin.channels.roles import make_pressure_role
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import InputError, MissingParameterError, Where
from drivetwin.estimation.data.prepare import collect_pressures
from drivetwin.estimation.result.estimate import Z95
from drivetwin.likelihood.input_smoothing import smooth_adaptive
from drivetwin.likelihood.measured_signal import MeasuredSignal, prepare_signal
from drivetwin.parameters import FINAL_DRIVE, make_ratio_id
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.dual_clutch import DualClutch, ShiftElement
from drivetwin.twin.distribution import ModelDistribution, describe_model
from drivetwin.twin.twin import Twin

GRID = 1e-3
"""Step of the observer's grid where speeds are sampled more slowly; least step of a speed [s]."""
LONGEST = 3.0
"""Longest stretch of a held gear before and after a shift that is observed [s]."""
FLOOR = 2e-5
"""Least noise of a speed as a share of its range: what an ideal sensor is given."""
ONSET = 0.4
"""Time before break-away [s] from which the on-coming element may carry torque, pressures unknown.
"""
VENT = 0.1
"""Time after it has handed over [s] within which an element of unknown pressure is empty."""
HAND_OVER = 10.0
"""Drift [1/sqrt(s)] of an unknown torque while the elements hand over: a level in 10 ms."""
RATE = 0.01
"""Time on either side of an instant over which the rate of the engine speed is taken [s]."""


@dataclass(frozen=True, eq=False)
class Recorded:
    """Measured input of an observer for one shift: fresh samples, SI; `pressures` may be empty.

    `time` (N,) contains every stamp of `speeds`. Its keys are `engine_speed`, `output_speed` and
    `wheel_speed`; the last may be missing.
    """

    shift: Shift
    time: FloatArray
    engine_torque: MeasuredSignal
    speeds: dict[str, MeasuredSignal]
    pressures: dict[str, MeasuredSignal]

    def smooth_speed(self, name: str, time: FloatArray) -> FloatArray:
        """A speed without most of its noise at `time` (n,)."""
        signal = self.speeds[name]
        return np.interp(time, signal.time, smooth_adaptive(signal))


def collect_recorded(log: ShiftLog, shift: Shift, i_in: float) -> Recorded:
    """The channels of a shift that an observer uses.

    Raises MissingChannelError without engine torque, input or output speed, InputError where they
    share too little time.
    """
    engine = "engine_speed" in log
    speeds = {
        "engine_speed": prepare_signal(log["engine_speed"])
        if engine
        else prepare_signal(log["input_speed"], i_in),
        "output_speed": prepare_signal(log["output_speed"]),
    }
    if "wheel_speed" in log:
        speeds["wheel_speed"] = prepare_signal(log["wheel_speed"])
    speeds = {
        name: (replace(signal, sigma=max(signal.sigma, FLOOR * float(np.ptp(signal.values)))))
        for name, signal in speeds.items()
    }
    torque = prepare_signal(log["engine_torque"])
    there = all(make_pressure_role(name) in log for name in (shift.offgoing, shift.oncoming))
    pressures = collect_pressures(log, shift) if there else {}
    used = (torque, *speeds.values(), *pressures.values())
    start = max(shift.before[0], shift.before[1] - LONGEST, *(s.time[0] for s in used))
    end = min(shift.after[1], shift.lockup_time + LONGEST, *(s.time[-1] for s in used))
    if not start < shift.torque_phase[0] or not end > shift.lockup_time:
        raise InputError(
            f"speeds and engine torque share only {start:.3f} s to {end:.3f} s, which is not the "
            "whole shift",
            "record them together from before the torque phase to after lock-up",
            Where(file=log.source),
        )
    speeds = {
        name: _reduce_samples(signal.select_span((start, end))) for name, signal in speeds.items()
    }
    even = start + GRID * np.arange(int((end - start) / GRID) + 1, dtype=np.float64)
    stamps = np.unique(np.round(np.concatenate([s.time for s in speeds.values()]), 7))
    sparse = float(np.median(np.diff(stamps))) > 1.5 * GRID
    time = np.union1d(stamps, even) if sparse else stamps
    return Recorded(shift, time, torque, speeds, pressures)


def _reduce_samples(signal: MeasuredSignal) -> MeasuredSignal:
    """Means over blocks of a signal sampled faster than the grid's least step."""
    count = max(1, round(GRID / float(np.median(np.diff(signal.time)))))
    kept = count * (signal.time.size // count)
    time, values = (x[:kept].reshape(-1, count).mean(axis=1) for x in (signal.time, signal.values))
    return MeasuredSignal(time, values, signal.sigma / float(np.sqrt(count)))


def is_driving(model: DualClutch, seen: Recorded, delay: float) -> BoolArray:
    """Determine if power flows from the engine over each step (N-1,): T_g = T_e - J1·ω_e' ≥ 0.

    The sign of T_e alone is not sufficient: with a released pedal a decelerating engine still
    drives. `delay` [s] is the delay of the engine torque.
    """
    middle = 0.5 * (seen.time[1:] + seen.time[:-1])
    before = np.maximum(middle - RATE, seen.time[0])
    after = np.minimum(middle + RATE, seen.time[-1])
    change = seen.smooth_speed("engine_speed", after) - seen.smooth_speed("engine_speed", before)
    torque = np.interp(middle + delay, seen.engine_torque.time, seen.engine_torque.values)
    return np.asarray(torque - model.J1 * change / (after - before) >= 0.0)


def build_course(model: DualClutch, seen: Recorded, delay: float, driving: BoolArray) -> Course:
    """Build the inputs and locks over the grid; `delay` [s] is the delay of the engine torque.

    `driving` (N-1,) is the result of `is_driving`.
    """
    time, shift = seen.time, seen.shift
    middle = 0.5 * (time[1:] + time[:-1])
    torque = seen.engine_torque
    locked = {
        shift.offgoing: middle < shift.inertia_phase[0],
        shift.oncoming: middle >= shift.lockup_time,
    }
    base, drift = {}, {}
    for one in model.elements:
        carried = _estimate_carried_torque(model, one, seen, middle)
        if not seen.pressures:
            window, hasty = _find_unknown_pressure(seen.shift, one.name, middle)
            carried = np.where(window, carried, 0.0)
            drift[one.name] = np.where(hasty, HAND_OVER, 0.0)
        else:
            drift[one.name] = np.zeros(middle.size)
        base[one.name] = np.where(locked[one.name], 0.0, carried)
    return Course(
        time,
        np.interp(middle + delay, torque.time, torque.values),
        driving,
        locked,
        base,
        drift,
        1.0 / float(np.median(np.diff(torque.time))),
    )


def _find_unknown_pressure(
    shift: Shift, name: str, middle: FloatArray
) -> tuple[BoolArray, BoolArray]:
    """Mark samples (n,) with possible torque of an element of unknown pressure, and its changes."""
    start, end = shift.inertia_phase
    by_oncoming = shift.kind.has_torque_phase_first
    if name == shift.oncoming:
        first = start - ONSET if by_oncoming else end - VENT
        window = (middle >= first) & (middle < end)
        return window, window & ((middle < start + VENT) | (middle >= end - VENT))
    last = start + VENT if by_oncoming else end + VENT
    window = (middle >= start) & (middle < last)
    return window, window & (by_oncoming | (middle >= end - VENT))


def compute_measured_slip(
    model: DualClutch, one: ShiftElement, seen: Recorded, time: FloatArray
) -> FloatArray:
    """Measured slip of an element (eq. 15) [rad/s] at `time` (n,)."""
    engine = seen.smooth_speed("engine_speed", time) / model.i_in
    return engine / one.i_c - one.i_out * seen.smooth_speed("output_speed", time)


def _estimate_carried_torque(
    model: DualClutch, one: ShiftElement, seen: Recorded, middle: FloatArray
) -> FloatArray:
    """Torque (n,) of an element if it slips: by its law, or a level without its pressure."""
    slip = compute_measured_slip(model, one, seen, middle)
    start, end = seen.shift.inertia_phase
    sense = np.sign(np.median(slip[(middle >= start) & (middle <= end)]))
    if one.name in seen.pressures:
        pressure = seen.pressures[one.name]
        above = np.interp(middle, pressure.time, smooth_adaptive(pressure)) - one.P0
        return np.asarray(sense * one.friction.evaluate(slip) * one.gain * np.maximum(above, 0.0))
    level = float(np.max(np.abs(seen.engine_torque.values))) * model.i_in * abs(one.i_c)
    return np.full(middle.size, float(sense) * level)


def select_uncertain(
    twin: Twin,
    shift: Shift,
    stems: tuple[str, ...],
    more: Mapping[str, float] | None = None,
) -> ModelDistribution:
    """Describe the parameters `stems` of the twin and the ratios of the shift.

    `J_prime` stands for that of its `select_inertia_gear`. `more` are further standard deviations
    by id, of errors that are not the twin's.
    Raises MissingParameterError where the twin has no value for one of them.
    """
    if twin.over_eta:
        raise MissingParameterError(
            "the twin has torques over η only, because its log had no output torque",
            "identify from a log that has one, or state eta on the vehicle card",
            Where(file=twin.name),
        )
    inertia = f"J_prime_{twin.select_inertia_gear(shift)}"
    ids = [inertia if stem == "J_prime" else stem for stem in stems]
    ratios = (make_ratio_id(shift.start_gear), make_ratio_id(shift.end_gear), FINAL_DRIVE)
    ids += [name for name in ratios if name in twin.covariance_ids]
    return describe_model(twin, shift, ids, more=more, laws=False)


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
