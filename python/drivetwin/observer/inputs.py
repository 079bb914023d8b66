# SPDX-License-Identifier: MIT
"""From a log and a shift to the course of inputs and locks that the observer works along."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.channels.roles import make_pressure_role
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import InputError, MissingParameterError, Where
from drivetwin.estimation.data.noise import prepare_signal
from drivetwin.estimation.data.prepare import collect_pressures
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.estimation.likelihood.data.input_smoothing import smooth_adaptive
from drivetwin.observer.linear_model import BoolArray, Course, FloatArray
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
    speeds = {name: _clip_noise(signal) for name, signal in speeds.items()}
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


def _clip_noise(signal: MeasuredSignal) -> MeasuredSignal:
    return replace(signal, sigma=max(signal.sigma, FLOOR * float(np.ptp(signal.values))))


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
