# SPDX-License-Identifier: MIT
"""Metrics of the quality of one shift, each a function of signals; absent where not computable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray, filter_zero_phase
from drivetwin.channels.roles import make_command_role
from drivetwin.channels.shiftlog import Channel, ShiftLog, compute_gap_limit
from drivetwin.shifts.shift import GearboxSpeeds, Shift, compute_gear_ratios, resample_speeds
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.spec import ShiftKind

_LATEST_REQUEST = 3.0
"""Longest time [s] from a request to the begin of the inertia phase."""
_COMMANDED = 0.05
"""Share of the largest command from which an element is commanded to close."""


def compute_duration(shift: Shift) -> float:
    """Duration of a shift [s]: from the begin of the torque phase to lock-up.

    Source: definition of this program; without a torque phase from break-away.
    """
    return shift.lockup_time - shift.torque_phase[0]


def compute_response_time(request: Channel, shift: Shift) -> float | None:
    """Time [s] from the request of the new gear to the begin of the inertia phase.

    `request` is the channel of role `requested_gear`. The request is the last change to the end
    gear, at most 3 s before the inertia phase; None without one. Source: definition of this
    program: delay after which the driver perceives a change of engine speed.
    """
    if not shift.end_gear.isdecimal():
        return None
    wanted = request.values == float(shift.end_gear)
    starts = request.time[1:][wanted[1:] & ~wanted[:-1]]
    begin = shift.inertia_phase[0]
    starts = starts[(starts <= begin) & (starts >= begin - _LATEST_REQUEST)]
    return begin - float(starts[-1]) if starts.size else None


def compute_command_response_time(command: Channel, shift: Shift) -> float | None:
    """Time [s] from the first command to the on-coming element to the begin of the inertia phase.

    `command` is the channel of role `pressure_command.<element>`. The first command is the rise
    above a twentieth of its largest value until lock-up, at most 3 s before the inertia phase;
    None without one. Source: definition of this program, as `compute_response_time`.
    """
    begin = shift.inertia_phase[0]
    inside = (command.time >= begin - _LATEST_REQUEST) & (command.time <= shift.lockup_time)
    time, values = command.time[inside], command.values[inside]
    if not values.size or not values.max() > 0.0:
        return None
    closing = values > _COMMANDED * values.max()
    starts = time[1:][closing[1:] & ~closing[:-1]]
    starts = starts[starts <= begin]
    return begin - float(starts[0]) if starts.size else None


def compute_rates(time: FloatArray, values: FloatArray) -> FloatArray:
    """Time derivatives (..., n) of `values` (..., n) sampled at `time` (n,), per s.

    Central differences, one-sided at both ends.
    """
    steps = np.diff(time)
    uniform = bool(np.allclose(steps, steps[0], rtol=1e-9, atol=0.0))
    spacing = float(steps.mean()) if uniform else time
    return np.asarray(np.gradient(values, spacing, axis=-1), dtype=np.float64)


def compute_largest_rate(time: FloatArray, values: FloatArray) -> float:
    """Largest magnitude of the time derivative of `values` (n,), in their unit per s.

    Central differences. With the angular acceleration of the wheel [rad/s^2] as `values` this is
    its peak jerk [rad/s^3]. Source: definition of jerk.
    """
    return float(np.abs(compute_rates(time, values)).max())


def compute_vibration_doses(time: FloatArray, acceleration: FloatArray) -> FloatArray:
    """Vibration dose values (...) of accelerations (..., n); see `compute_vibration_dose`."""
    fourth = np.square(np.square(acceleration))
    return np.asarray(np.trapezoid(fourth, time, axis=-1) ** 0.25, dtype=np.float64)


def compute_vibration_dose(time: FloatArray, acceleration: FloatArray) -> float:
    """Vibration dose value (∫ a^4 dt)^¼ of `acceleration` (n,), in its unit times s^¼.

    For a in m/s^2 the unit is m/s^1.75, for rad/s^2 rad/s^1.75. The frequency weighting of the
    standard is not applied. Source: ISO 2631-1:1997, section 6.3.2.
    """
    return float(compute_vibration_doses(time, acceleration))


QUALITY_UNITS: dict[str, str] = {
    "shift_time": "s",
    "response_time": "s",
    "torque_phase_time": "s",
    "inertia_phase_time": "s",
    "flare_speed": "rad/s",
    "undershoot_speed": "rad/s",
    "slip_at_lockup": "rad/s",
    "torque_hole_depth": "N*m",
    "torque_hole_area": "N*m*s",
    "tie_up_torque": "N*m",
    "lockup_oscillation": "N*m",
    "torque_rate_max": "N*m/s",
    "wheel_jerk_max": "rad/s^3",
    "wheel_jerk_of_speed_max": "rad/s^3",
    "vibration_dose": "rad/s^1.75",
    "friction_work": "J",
    "friction_power_max": "W",
}
"""SI unit of every figure that `compute_shift_quality` may return."""

_REFERENCE = 0.1
"""Span [s] whose mean is the torque before the shift, or the slip after it."""
_RING = 0.5
"""Span after lock-up [s] that counts as the response to the shift."""
_BAND = 32.0
"""Cut-off of the low-pass on torque [Hz]: upper end of felt longitudinal vibration."""
_SPEED_BAND = 25.0
_JERK_BAND = 8.0
"""Cut-off of the low-pass on a speed that is differentiated twice [Hz]."""
_SLOWEST = 0.2
"""Cut-off over sampling rate from which on there is no jerk of a speed."""
_FEWEST = 16
"""Fewest samples of a jerk, and of a ratio."""
_AGAINST = 0.05
"""Share of friction work of the wrong sign up to which the on-coming element alone carries T_o."""


@dataclass(frozen=True, eq=False)
class _Torque:
    """Output torque over the shift and its response, low-passed, on a uniform grid."""

    time: FloatArray
    values: FloatArray

    def select_span(self, start: float, end: float) -> tuple[FloatArray, FloatArray]:
        keep = (self.time >= start) & (self.time <= end)
        return self.time[keep], self.values[keep]


def compute_shift_quality(
    log: ShiftLog,
    card: VehicleCard,
    shift: Shift,
    J_vehicle: float | None = None,
    speeds: GearboxSpeeds | None = None,
) -> dict[str, float]:
    """Figures of one shift by name, units in QUALITY_UNITS.

    `speeds` are those of the log by `resample_speeds`, which spares computing them for each shift.

    Ratios are those of the speeds while each gear is held; of the card if that is too short.
    `slip_at_lockup`: mean slip of the on-coming element (eq. 15) over 0.1 s from lock-up;
    `flare_speed`: input speed above the higher of the two synchronous speeds; `undershoot_speed`:
    below the lower one (both from smoothed speeds, 0 in a clean shift).
    `response_time`: see `compute_response_time`, with a channel `requested_gear`, else
    `compute_command_response_time`, with one of the on-coming element's commanded pressure.
    Without an output torque `wheel_jerk_of_speed_max`: largest second derivative of the output
    speed over i_f (low-pass 8 Hz, zero phase), from torque phase to 0.5 s after lock-up.
    With an output torque T_o (low-pass 32 Hz, zero phase):
    `torque_hole_depth`, `torque_hole_area`: fall below (in the direction of power) its mean over
    0.1 s before the torque phase, from there to its return or the lock-up;
    `tie_up_torque`: fall in the torque phase beyond T_o·i_after/i_before, where a clean hand-over
    of a power-on upshift ends; `compute_lockup_oscillation`: max - min within 0.5 s from lock-up;
    `torque_rate_max`: largest |dT_o/dt| from torque phase to 0.5 s after lock-up;
    `wheel_jerk_max` = torque_rate_max·i_f/J_v; `vibration_dose` = (∫ a^4 dt)^¼ over the same time
    with a = i_f·(T_o - straight line through both ends)/J_v, the wheel's angular acceleration (eq.
    9; times the wheel radius: m/s^1.75 of ISO 2631-1, unweighted). J_v is `J_vehicle` [kg m2], or
    that of the card. `friction_work`, `friction_power_max`: of the on-coming
    element in the inertia phase, T_c = T_o/iout (eq. 16; leaves out the output
    side's inertia and the drums) times the slip (eq. 15). Friction makes no energy: where more
    than 5 % of the work comes out negative the off-going element carries T_o, as in a power-on
    downshift, and there are no such figures.
    """
    start, end = shift.torque_phase[0], shift.lockup_time
    figures = {
        "shift_time": compute_duration(shift),
        "torque_phase_time": shift.torque_phase[1] - start,
        "inertia_phase_time": end - shift.inertia_phase[0],
    }
    response = _compute_response_time(log, shift)
    figures |= {} if response is None else {"response_time": response}
    speeds = speeds or resample_speeds(log, card)
    stated = compute_gear_ratios(card)
    ratios = stated | _measure_ratios(speeds, shift)
    i_c, i_out = card.get_clutch_ratios(shift.oncoming)
    clutch = i_c, i_out * ratios[shift.end_gear] / stated[shift.end_gear]
    figures |= _compute_speed_excess(speeds, ratios, shift)
    figures |= _compute_residual_slip(speeds, clutch, shift)
    torque = _select_output_torque(log, shift)
    if torque is not None:
        J_v = J_vehicle or card.nominal_vehicle_inertia
        figures |= _measure_torque_hole(torque, ratios, shift)
        figures |= _compute_vibration(torque, shift, card.final_drive.value / J_v)
        figures |= _compute_friction_work(torque, speeds, clutch, shift)
    else:
        figures |= _compute_speed_jerk(speeds, shift, card.final_drive.value)
    return figures


def _compute_response_time(log: ShiftLog, shift: Shift) -> float | None:
    """Compute the time [s] from request or command to the inertia phase; None without either."""
    response = None
    if "requested_gear" in log:
        response = compute_response_time(log["requested_gear"], shift)
    command = make_command_role(shift.oncoming)
    if response is None and command in log:
        response = compute_command_response_time(log[command], shift)
    return response


def _compute_speed_jerk(
    speeds: GearboxSpeeds, shift: Shift, final_drive: float
) -> dict[str, float]:
    """Peak jerk of the wheel by the output speed; none where sampling is too slow for it."""
    if _JERK_BAND * speeds.step >= _SLOWEST:
        return {}
    wide = (speeds.time >= shift.torque_phase[0] - _RING) & (
        speeds.time <= shift.lockup_time + 2.0 * _RING
    )
    time = speeds.time[wide]
    if np.count_nonzero(wide) < _FEWEST or np.diff(time).max() > compute_gap_limit(time):
        return {}
    grid = np.arange(time[0], time[-1], speeds.step)
    wheel = np.interp(grid, time, speeds.output[wide]) / final_drive
    smooth = filter_zero_phase(wheel, speeds.step, _JERK_BAND)
    acceleration = np.gradient(smooth, grid)
    inside = (grid >= shift.torque_phase[0]) & (grid <= shift.lockup_time + _RING)
    if np.count_nonzero(inside) < _FEWEST:
        return {}
    return {"wheel_jerk_of_speed_max": compute_largest_rate(grid[inside], acceleration[inside])}


def _filter_low_pass(values: FloatArray, step: float, cutoff: float) -> FloatArray:
    """Zero-phase Butterworth of order 2 run twice; unchanged where sampling is too slow for it."""
    if cutoff * step >= 0.4 or len(values) < 16:
        return values
    return filter_zero_phase(values, step, cutoff)


def _sample_uniformly(channel: Channel, span: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """Finite samples within `span` on an even grid of the channel's own step; none with a gap."""
    keep = np.isfinite(channel.values) & (channel.time >= span[0]) & (channel.time <= span[1])
    time, values = channel.time[keep], channel.values[keep]
    if len(time) < 16 or np.diff(time).max() > compute_gap_limit(channel.time):
        return np.empty(0), np.empty(0)
    grid = np.arange(time[0], time[-1], channel.step)
    return grid, np.interp(grid, time, values)


def _select_output_torque(log: ShiftLog, shift: Shift) -> _Torque | None:
    """T_o from 0.3 s before the torque phase to the end of the response; None where missing."""
    if "output_torque" not in log:
        return None
    channel = log["output_torque"]
    span = (
        shift.torque_phase[0] - 3 * _REFERENCE,
        min(shift.lockup_time + 2 * _RING, shift.after[1]),
    )
    time, values = _sample_uniformly(channel, span)
    if not len(time) or time[-1] < shift.lockup_time:
        return None
    return _Torque(time, _filter_low_pass(values, channel.step, _BAND))


def _measure_ratios(speeds: GearboxSpeeds, shift: Shift) -> dict[str, float]:
    """Ratio of each gear of the shift by the speeds while it is held; none of too few samples.

    A rounded ratio of the card would make a slip of a locked element.
    """
    found = {}
    settled = (shift.after[0] + _REFERENCE, shift.after[1])
    for gear, span in ((shift.start_gear, shift.before), (shift.end_gear, settled)):
        first, stop = np.searchsorted(speeds.time, span)
        part = speeds.select(int(first), int(stop))
        if part.time.size >= _FEWEST:
            found[gear] = float(part.input @ part.output / (part.output @ part.output))
    return found


def _compute_speed_excess(
    speeds: GearboxSpeeds, ratios: dict[str, float], shift: Shift
) -> dict[str, float]:
    margin = 0.1
    near = (speeds.time >= shift.inertia_phase[0] - margin) & (
        speeds.time <= shift.lockup_time + margin
    )
    pair = sorted([ratios[shift.start_gear], ratios[shift.end_gear]])
    inlet = _filter_low_pass(speeds.input[near], speeds.step, _SPEED_BAND)
    outlet = _filter_low_pass(speeds.output[near], speeds.step, _SPEED_BAND)
    inside = (speeds.time[near] >= shift.inertia_phase[0]) & (
        speeds.time[near] <= shift.lockup_time
    )
    if not inside.any():
        return {}
    above = (inlet - pair[1] * outlet)[inside]
    below = (pair[0] * outlet - inlet)[inside]
    return {
        "flare_speed": max(0.0, float(above.max())),
        "undershoot_speed": max(0.0, float(below.max())),
    }


def _compute_residual_slip(
    speeds: GearboxSpeeds, ratios: tuple[float, float], shift: Shift
) -> dict[str, float]:
    """Residual slip after lock-up of the on-coming element."""
    i_c, i_out = ratios
    held = (speeds.time >= shift.lockup_time) & (speeds.time <= shift.lockup_time + _REFERENCE)
    if not held.any():
        return {}
    slip = speeds.input[held] / i_c - i_out * speeds.output[held]
    return {"slip_at_lockup": float(slip.mean())}


def _measure_torque_hole(
    torque: _Torque, ratios: dict[str, float], shift: Shift
) -> dict[str, float]:
    start, end = shift.torque_phase[0], shift.lockup_time
    before = torque.select_span(start - _REFERENCE, start)[1]
    time, values = torque.select_span(start, end)
    if not len(before) or len(values) < 2:
        return {}
    reference = float(before.mean())
    fall = np.sign(reference) * (reference - values)
    inertia = np.flatnonzero((time >= shift.inertia_phase[0]) & (fall <= 0.0))
    stop = int(inertia[0]) + 1 if len(inertia) else len(fall)
    hole = np.clip(fall[:stop], 0.0, None)
    figures = {
        "torque_hole_depth": float(hole.max()),
        "torque_hole_area": float(np.trapezoid(hole, time[:stop])),
    }
    step = ratios[shift.end_gear] / ratios[shift.start_gear]
    dip = torque.select_span(*shift.torque_phase)[1]
    if shift.kind is ShiftKind.POWER_ON_UP and len(dip):
        figures["tie_up_torque"] = max(0.0, step * reference - float(dip.min()))
    return figures


def _compute_vibration(torque: _Torque, shift: Shift, gain: float) -> dict[str, float]:
    """`gain` turns torque at the output shaft into angular acceleration of the wheel: i_f/J_v."""
    time, values = torque.select_span(shift.torque_phase[0], shift.lockup_time + _RING)
    ring = torque.select_span(shift.lockup_time, shift.lockup_time + _RING)[1]
    if len(values) < 3 or len(ring) < 3:
        return {}
    rate = compute_largest_rate(time, values)
    line = np.interp(time, time[[0, -1]], values[[0, -1]])
    dose = compute_vibration_dose(time, gain * (values - line))
    return {
        "lockup_oscillation": float(np.ptp(ring)),
        "torque_rate_max": rate,
        "wheel_jerk_max": gain * rate,
        "vibration_dose": dose,
    }


def _compute_friction_work(
    torque: _Torque, speeds: GearboxSpeeds, ratios: tuple[float, float], shift: Shift
) -> dict[str, float]:
    i_c, i_out = ratios
    time, values = torque.select_span(*shift.inertia_phase)
    if len(time) < 2:
        return {}
    slip = np.interp(time, speeds.time, speeds.input / i_c - i_out * speeds.output)
    power = values / i_out * slip
    against, along = (float(np.trapezoid(np.maximum(p, 0.0), time)) for p in (-power, power))
    if against > _AGAINST * (against + along):
        return {}
    return {
        "friction_work": float(np.trapezoid(power, time)),
        "friction_power_max": float(power.max()),
    }
