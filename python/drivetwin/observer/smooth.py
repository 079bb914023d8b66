# SPDX-License-Identifier: MIT
"""Smoother as an observer: torques of a shift from all speeds before, during and after it.

The twin's parameters are unknown constants of the state, with the covariance of the twin. A first
pass gives the motion about which the model is linearised; the second estimates all states. The load
of the drive is unknown and may drift with the road. The drift rate of the friction about its law is
estimated from the log by maximum likelihood.

Kalman filter and Rauch-Tung-Striebel smoother of a linear model that changes with time. The
backward pass is in the form of Bryson and Frazier (1963), which inverts no covariance: locked
elements and constant parameters make covariances singular. Measurements are scalars, taken one
after the other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from drivetwin._util.check_arguments import check_arguments
from drivetwin.channels.roles import make_pressure_role
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import SimulationError
from drivetwin.findings import render
from drivetwin.observer.linear_model import (
    CARRIED,
    LOAD,
    SPEEDS,
    STATES,
    TORQUE_ERROR,
    Band,
    BoolArray,
    FloatArray,
    Linear,
    Observation,
    Recorded,
    build_course,
    build_linear_model,
    collect_recorded,
    compute_impulse_response,
    compute_measured_slip,
    is_driving,
    select_uncertain,
)
from drivetwin.shifts.detect import trim_to_recorded, trim_to_window
from drivetwin.shifts.lockup_clutch import refer_to_turbine
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.added_elements import describe_added_elements
from drivetwin.simulation.dual_clutch import DualClutch, Trajectory
from drivetwin.twin.distribution import ModelDistribution
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import simulate_shift
from drivetwin.vehicle.spec import PriorValue

FAR = 15.0
"""Longest time [s] of the gears held before and after a shift. One second of the smoother takes
about 25 MB, and more distant samples contain no information on the shift."""


@check_arguments
def estimate_torques(twin: Twin, log: ShiftLog, shift: Shift) -> Observation:
    """Estimate the torques of one shift with 95 % bands, without any output torque in the log.

    If the converter is open and the twin has its map, the turbine torque replaces the engine
    torque. The gears before and after the shift are used as far as the inputs were recorded, and
    for FAR at most; the notes contain any cut.
    The smoother's model is the dual clutch; where the twin has other elements, their effect on its
    own run widens the bands.
    Raises MissingParameterError where the twin is incomplete, MissingChannelError and InputError
    where the log is incomplete, DamagedChannelError where an input has a gap in the shift,
    SimulationError where the twin's own run fails.
    """
    log = refer_to_turbine(log, twin.build_card(), shift)
    fills = {one.name: PriorValue(one.P0) for one in twin.build_dual_clutch(shift).elements}
    whole = trim_to_window(trim_to_recorded(log, shift, fills, twin.i_in), (FAR, FAR))
    if twin.added_element_values:
        found = _add_element_error(smooth(twin.drop_added_elements(), log, whole), twin, log, whole)
    else:
        found = smooth(twin, log, whole)
    cuts = render(whole.findings[len(shift.findings) :])
    return replace(found, notes=(*cuts, *found.notes))


def _add_element_error(found: Observation, twin: Twin, log: ShiftLog, shift: Shift) -> Observation:
    """Widen the bands by the effect of the added elements on the run of the twin itself."""
    channels = {role: one for role, one in log.channels.items() if role != "output_torque"}
    quiet = replace(log, channels=channels)
    runs = [simulate_shift(one, quiet, shift) for one in (twin, twin.drop_added_elements())]
    for one in runs:
        if one.status != "completed":
            raise SimulationError(
                f"the simulation of shift {shift.start_gear}-{shift.end_gear} ended: {one.status}",
                "identify the log again without the added element",
            )
    whole, reduced = (_collect_torques(one.trajectory) for one in runs)

    def widen(name: str, band: Band) -> Band:
        error = np.interp(found.time, runs[0].trajectory.time, whole[name] - reduced[name])
        return Band(band.value, np.hypot(band.std, error))

    clutches = {name: widen(name, band) for name, band in found.clutch_torque.items()}
    note = f"bands contain the error by {describe_added_elements(twin.added_element_values)}"
    return replace(
        found,
        output_torque=widen("output_torque", found.output_torque),
        clutch_torque=clutches,
        notes=(*found.notes, note),
    )


def _collect_torques(run: Trajectory) -> dict[str, FloatArray]:
    """Collect the torques (n,) of a run [N m]: `output_torque`, and those of the elements."""
    return {"output_torque": run.shaft_torque, **run.clutch_torque}


Measurement = tuple[FloatArray, float, float]
"""Row (n,) of the state, the value read and its variance."""


@dataclass(frozen=True, eq=False)
class Process:
    """x_{k+1} = F_k·x_k + b_k + noise of covariance diag(q_k); F (N-1, n, n), b and q (N-1, n).

    `mean` (n,) and `covariance` (n, n) are those of the start; `measurements[k]` are taken at
    grid point k; `impulses[k]` (n, n) is further noise that enters before grid point k.
    """

    transition: FloatArray
    push: FloatArray
    noise: FloatArray
    mean: FloatArray
    covariance: FloatArray
    measurements: Sequence[Sequence[Measurement]]
    impulses: Mapping[int, FloatArray] = field(default_factory=dict)

    def predict_state(self, k: int, x: FloatArray, P: FloatArray) -> tuple[FloatArray, FloatArray]:
        """State and covariance at grid point k before its measurements, from those at k-1."""
        F = self.transition[k - 1]
        P = F @ P @ F.T
        P[np.diag_indices(x.size)] += self.noise[k - 1]
        if k in self.impulses:
            P += self.impulses[k]
        return F @ x + self.push[k - 1], P


@dataclass(frozen=True, eq=False)
class Filtered:
    """State (N, n) and covariance (N, n, n) given the past; -2·log-likelihood of the log."""

    mean: FloatArray
    covariance: FloatArray
    surprise: float


def filter_forward(process: Process) -> Filtered:
    """Forward pass."""
    x, P = process.mean.copy(), process.covariance.copy()
    count, size = len(process.measurements), x.size
    means, covariances = np.empty((count, size)), np.empty((count, size, size))
    surprise = 0.0
    for k in range(count):
        if k > 0:
            x, P = process.predict_state(k, x, P)
        for row, value, variance in process.measurements[k]:
            along = P @ row
            power = float(row @ along) + variance
            miss = value - float(row @ x)
            x = x + along * (miss / power)
            P = P - np.outer(along, along / power)
            surprise += miss * miss / power + float(np.log(power))
        means[k], covariances[k] = x, P
    return Filtered(means, covariances, surprise)


def smooth_states(process: Process) -> tuple[FloatArray, FloatArray]:
    """State (N, n) and covariance (N, n, n) given the whole log."""
    forward = filter_forward(process)
    means, covariances = forward.mean.copy(), forward.covariance.copy()
    size = process.mean.size
    pull, weight = np.zeros(size), np.zeros((size, size))
    for k in range(len(process.measurements) - 1, -1, -1):
        P = forward.covariance[k]
        means[k] = forward.mean[k] - P @ pull
        covariances[k] = P - P @ weight @ P
        pull, weight = _propagate_adjoint(process, forward, k, pull, weight)
    return means, covariances


def _propagate_adjoint(
    process: Process, forward: Filtered, k: int, pull: FloatArray, weight: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Adjoint state and its weight after grid point k-1, from those after point k."""
    x, P = process.mean, process.covariance
    if k > 0:
        x, P = process.predict_state(k, forward.mean[k - 1], forward.covariance[k - 1])
    stages = []
    for row, value, variance in process.measurements[k]:
        along = P @ row
        power = float(row @ along) + variance
        miss = value - float(row @ x)
        stages.append((row, along / power, power, miss))
        x = x + along * (miss / power)
        P = P - np.outer(along, along / power)
    for row, gain, power, miss in reversed(stages):
        # (I - gain·row)ᵀ from the left, and from the right for the weight.
        pull = pull - row * (float(gain @ pull) + miss / power)
        side = weight @ gain
        weight = (
            weight
            - np.outer(row, side)
            - np.outer(side, row)
            + np.outer(row, row) * (float(gain @ side) + 1.0 / power)
        )
    if k == 0:
        return pull, weight
    F = process.transition[k - 1]
    return F.T @ pull, F.T @ weight @ F


STEMS = ("eta", "J_prime", "J_out", "J_vehicle", "k_o", "c_o", "te_delay")
"""Parameters that count as unknown within the twin's covariance; the friction has its own state."""
READ = 0.3
"""Share of the pressure noise left after smoothing; it acts as an error of P0."""
LOAD_WALK = 0.05
"""Drift of the load within a second, as a share of the greatest drive torque: grades change."""
FRICTION_ERROR = 0.1
"""Relative standard deviation of an element's torque by its law at the start of its slip."""
WALKS = (0.05, 0.2, 0.8)
"""Candidates for the drift [1/sqrt(s)] of the friction law's relative error; chosen by the log."""
FREE_WALKS = (0.3, 1.0, 3.0)
"""Candidates for the drift [1/sqrt(s)] of an element's torque without a pressure signal."""
LEVEL_ERROR = {True: 1.0, False: 0.05}
"""Initial spread about zero of an element's torque without a pressure signal: for an off-going
element (True), which breaks away under load, and for an on-coming one (False)."""
TIGHT = 1e-3
"""Slip [rad/s] allowed where an element is locked."""
RATE_SPAN = 0.01
"""Time before lock-up over which the rate of the slip is taken [s]."""
SMALL = 1e-3
"""Part of a standard deviation over which parameters are differenced."""


@dataclass(frozen=True, eq=False)
class _Setting:
    """A shift with its model parameters, grid and inputs.

    Which way the power flows is that of the twin's values: a small step along a parameter turns
    nothing round.
    """

    seen: Recorded
    known: ModelDistribution
    directions: FloatArray
    driving: BoolArray

    def linearize_model(self, values: FloatArray) -> tuple[DualClutch, Linear]:
        """The linear model at parameters `values` (p,)."""
        model = self.known.build_model(values)
        delay = self.known.to_named(values)["te_delay"]
        return model, build_linear_model(model, build_course(model, self.seen, delay, self.driving))


def smooth(twin: Twin, log: ShiftLog, shift: Shift) -> Observation:
    """Torques of one shift from speeds and engine torque; an output torque is not looked at.

    Raises MissingParameterError where the twin is incomplete, MissingChannelError and InputError
    where the log is.
    """
    seen = collect_recorded(log, shift, twin.i_in)
    fills = {f"P0.{name}": READ * p.sigma for name, p in seen.pressures.items()}
    known = select_uncertain(twin, shift, (*STEMS, *fills), fills)
    driving = is_driving(
        known.build_model(known.values), seen, known.to_named(known.values)["te_delay"]
    )
    setting = _Setting(seen, known, known.directions, driving)
    model, base = setting.linearize_model(known.values)
    none = np.zeros((base.transition.shape[0], STATES, 0))
    walks = WALKS if setting.seen.pressures else FREE_WALKS
    rough = _build_process(setting, model, base, none, walks[1])
    motion, _ = smooth_states(rough)
    slopes, by_parameter = _compute_slopes(setting, base, motion)
    trials = [_build_process(setting, model, base, slopes, walk) for walk in walks]
    best = min(trials, key=lambda process: filter_forward(process).surprise)
    means, covariances = smooth_states(best)
    bands = _compute_bands(base, by_parameter, means, covariances)
    time = 0.5 * (setting.seen.time[1:] + setting.seen.time[:-1])
    return Observation(
        shift,
        time,
        bands.pop("output_torque"),
        bands,
        _collect_notes(setting.seen, log),
    )


def _collect_notes(seen: Recorded, log: ShiftLog) -> tuple[str, ...]:
    texts = []
    if not seen.pressures:
        elements = seen.shift.offgoing, seen.shift.oncoming
        missing = " and ".join(name for name in elements if make_pressure_role(name) not in log)
        texts.append(f"no pressure of {missing}: clutch torques follow from the speeds alone")
    if "wheel_speed" not in seen.speeds:
        texts.append("no wheel speed: what lies behind the shaft follows from the model")
    return tuple(texts)


def _compute_slopes(
    setting: _Setting, base: Linear, motion: FloatArray
) -> tuple[FloatArray, Mapping[str, FloatArray]]:
    """Effect of one standard deviation along each direction about `motion` (N, 8).

    On a step's end state (N-1, 8, r), and on the observed torques (N-1, r) by name.
    """
    before = motion[:-1]
    middle = 0.5 * (motion[1:] + motion[:-1])
    pushes, torques = [], []
    for column in setting.directions.T:
        _, moved = setting.linearize_model(setting.known.values + SMALL * column)
        change = np.einsum("kij,kj->ki", moved.transition - base.transition, before)
        pushes.append((change + moved.push - base.push) / SMALL)
        torques.append(
            {
                name: (
                    np.einsum("kj,kj->k", moved.rows[name] - base.rows[name], middle)
                    + moved.constants[name]
                    - base.constants[name]
                )
                / SMALL
                for name in base.rows
            }
        )
    if not pushes:
        return np.zeros((*before.shape, 0)), {n: np.zeros((len(before), 0)) for n in base.rows}
    by_name = {name: np.column_stack([one[name] for one in torques]) for name in base.rows}
    return np.stack(pushes, axis=2), by_name


def _build_process(
    setting: _Setting, model: DualClutch, base: Linear, slopes: FloatArray, walk: float
) -> Process:
    """The estimation problem with parameter directions as constant states behind the eight."""
    count, _, extra = slopes.shape
    size = STATES + extra
    transition = np.zeros((count, size, size)) + np.eye(size)
    transition[:, :STATES, :STATES] = base.transition
    transition[:, :STATES, STATES:] = slopes
    push, noise = np.zeros((count, size)), np.zeros((count, size))
    push[:, :STATES] = base.push
    step = np.diff(setting.seen.time)
    drive = _compute_drive_torque(setting.seen, model)
    torque = setting.seen.engine_torque
    noise[:, TORQUE_ERROR] = torque.sigma**2 * (
        1.0 - base.transition[:, TORQUE_ERROR, TORQUE_ERROR] ** 2
    )
    for place, one in enumerate(model.elements):
        drift = np.maximum(base.drift[one.name], walk)
        noise[:, CARRIED + place] = np.nan_to_num(drift**2 * step)
    noise[:, LOAD] = (LOAD_WALK * drive) ** 2 * step
    mean, spread = _estimate_start(setting, model, drive)
    covariance = np.diag(np.concatenate([spread**2, np.ones(extra)]))
    mean = np.concatenate([mean, np.zeros(extra)])
    measured = _collect_measurements(setting.seen, model, size)
    return Process(
        transition,
        push,
        noise,
        mean,
        covariance,
        measured,
        _build_lock_up_impulse(setting.seen, model, size),
    )


def _compute_drive_torque(seen: Recorded, model: DualClutch) -> float:
    """Greatest torque at the wheel that the engine torque of the log makes [N m]."""
    ratio = max(abs(model.i_in * one.i_c * one.i_out) for one in model.elements)
    return float(np.max(np.abs(seen.engine_torque.values))) * ratio * model.i_f


def _estimate_start(
    setting: _Setting, model: DualClutch, drive: float
) -> tuple[FloatArray, FloatArray]:
    """Mean and standard deviation (8,) of the state at the first grid point."""
    seen = setting.seen
    first = seen.time[:1]
    engine = float(seen.smooth_speed("engine_speed", first)[0])
    output = float(seen.smooth_speed("output_speed", first)[0])
    torque = model.load.constant / model.i_f
    mean = np.array([engine, output, output / model.i_f, torque / model.k_o, 0, 0, 0, 0.0])
    mean[LOAD] = model.load.constant
    spread = np.array([1.0, 1.0, 1.0, drive / model.i_f / model.k_o, 0, 0, 0, 0.0])
    spread[TORQUE_ERROR], spread[LOAD] = seen.engine_torque.sigma, drive
    spread[CARRIED:LOAD] = FRICTION_ERROR
    if not seen.pressures:
        mean[CARRIED:LOAD] = -1.0
        for place, one in enumerate(model.elements):
            spread[CARRIED + place] = LEVEL_ERROR[one.name == seen.shift.offgoing]
    return mean, spread


def _collect_measurements(seen: Recorded, model: DualClutch, size: int) -> list[list[Measurement]]:
    """Speeds at their stamps; no slip where a gear begins to be held."""
    found: list[list[Measurement]] = [[] for _ in seen.time]
    for place, name in enumerate(("engine_speed", "output_speed", "wheel_speed")):
        if name not in seen.speeds:
            continue
        signal = seen.speeds[name]
        row = np.zeros(size)
        row[place] = 1.0
        points = np.searchsorted(seen.time, np.round(signal.time, 7))
        for k, value in zip(points.tolist(), signal.values.tolist(), strict=True):
            found[k].append((row, value, signal.sigma**2))
    held = {
        seen.shift.offgoing: 0,
        seen.shift.oncoming: _find_grid_point(seen, seen.shift.lockup_time),
    }
    for one in model.elements:
        row = np.zeros(size)
        row[:2] = 1.0 / (model.i_in * one.i_c), -one.i_out
        found[held[one.name]].append((row, 0.0, TIGHT**2))
    return found


def _build_lock_up_impulse(seen: Recorded, model: DualClutch, size: int) -> dict[int, FloatArray]:
    """Impulse of the on-coming element by which its lock-up may be early or late.

    Locking δt late, the element has slipped on for that time: its slip ends all the same, and
    engine and output share the difference by their inertias.
    """
    shift = seen.shift
    one = next(e for e in model.elements if e.name == shift.oncoming)
    k = _find_grid_point(seen, shift.lockup_time)
    before = np.array([seen.time[k] - RATE_SPAN, seen.time[k]])
    rate = float(np.diff(compute_measured_slip(model, one, seen, before))[0]) / RATE_SPAN
    step = float(seen.time[k] - seen.time[k - 1])
    jump = rate * float(np.hypot(shift.sigma.get("lockup", 0.0), 0.5 * step))
    along, g = compute_impulse_response(model, one)
    column = np.zeros(size)
    column[:SPEEDS] = along / (along @ g) * jump
    return {k: np.outer(column, column)}


def _find_grid_point(seen: Recorded, time: float) -> int:
    return min(int(np.searchsorted(seen.time, time)), seen.time.size - 1)


def _compute_bands(
    base: Linear,
    by_parameter: Mapping[str, FloatArray],
    means: FloatArray,
    covariances: FloatArray,
) -> dict[str, Band]:
    """Observed torques in the middle of the steps, with all that is not known of them."""
    middle = 0.5 * (means[1:] + means[:-1])
    found = {}
    for name, row in base.rows.items():
        whole = np.concatenate([row, by_parameter[name]], axis=1)
        value = np.einsum("kj,kj->k", whole, middle) + base.constants[name]
        variance = np.einsum("ki,kij,kj->k", whole, covariances[1:], whole)
        found[name] = Band(value, np.sqrt(np.maximum(variance, 0.0)))
    return found
