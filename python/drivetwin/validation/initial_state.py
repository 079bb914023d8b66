# SPDX-License-Identifier: MIT
"""Start of a simulation from the first measured moments of a gear that is held."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.errors import MissingChannelError, Where
from drivetwin.estimation.data.noise import estimate_white_noise
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.dual_clutch import DualClutch, State

_SPAN = 0.08
"""Length of the local fit [s]: well under a period of the shaft oscillation."""
_SHOWN = ("output_torque", "input_speed", "output_speed", "wheel_speed")
"""Channels that show the state."""
_CURVED_FROM = 6
"""Number of samples from which a parabola is fitted, a straight line below."""


_CALM = 1.5
"""Scatter about the local fit, relative to the usual one, up to which a moment is calm."""
_RIPPLE = 1e-3
"""Scatter that always counts as calm, relative to the largest torque: noise-free data have none."""


@dataclass(frozen=True)
class _Local:
    """Value, slope [1/s] and variance of the value at the start of a local fit; its scatter."""

    value: float
    slope: float
    variance: float
    scatter: float


def find_quiescent_time(log: ShiftLog, span: tuple[float, float]) -> float:
    """First time in `span` [s] at which a local fit describes the output torque, clear of gaps.

    In the lock-up oscillation of the shift before, or in a throttle step, the shaft's state cannot
    be read off a few samples. Without an output-torque channel: the start of the span.
    """
    times = np.arange(span[0], span[1] - _SPAN, _SPAN)
    for low, high in (gap for role in _SHOWN if role in log for gap in log[role].gaps):
        times = times[(times + _SPAN <= low) | (times >= high)]
    if "output_torque" not in log or times.size == 0:
        return float(times[0]) if times.size else span[0]
    torque = log["output_torque"]
    scatter = np.array([_fit_local(torque, float(time)).scatter for time in times])
    calm = scatter <= _CALM * np.median(scatter) + _RIPPLE * float(np.abs(torque.values).max())
    return float(times[np.argmax(calm)])


def estimate_start_state(model: DualClutch, log: ShiftLog, shift: Shift, time: float) -> State:
    """State at `time` [s] with the off-going element of `shift` locked.

    Output torque and its slope give the shaft's twist and twist rate; the speeds are then pooled
    by their noise into one motion that keeps the gear ratio exactly. A channel that is not recorded
    at that time takes no part; without an output torque the shaft is taken to transmit the engine
    torque in steady state.
    Raises MissingChannelError where neither input nor output speed is there.
    """
    ratio = model.get_overall_ratio(shift.offgoing)
    torque = (
        _fit_local(log["output_torque"], time) if _is_recorded(log, "output_torque", time) else None
    )
    rate = torque.slope / model.k_o if torque is not None else 0.0
    motions = []
    if _is_recorded(log, "input_speed", time):
        motions.append((_fit_local(log["input_speed"], time), ratio / model.i_in, 0.0))
    if _is_recorded(log, "output_speed", time):
        motions.append((_fit_local(log["output_speed"], time), 1.0, 0.0))
    if _is_recorded(log, "wheel_speed", time):
        motions.append((_fit_local(log["wheel_speed"], time), 1.0 / model.i_f, rate))
    if not motions:
        raise MissingChannelError(
            "no channel for input, output or wheel speed: the simulation has no start",
            "map at least one of them with --channels",
            Where(file=log.source),
        )
    weights = np.array([scale**2 / fit.variance for fit, scale, _ in motions])
    speeds = np.array([fit.value / scale + lead for fit, scale, lead in motions])
    output_speed = float(weights @ speeds / weights.sum())
    wheel_speed = (output_speed - rate) / model.i_f
    if torque is not None:
        carried = torque.value - model.c_o * rate
    else:
        engine_torque = _fit_local(log["engine_torque"], time).value
        carried = model.compute_steady_torque(engine_torque, ratio, wheel_speed)
    return State(
        engine_speed=ratio * output_speed,
        output_speed=output_speed,
        wheel_speed=wheel_speed,
        twist=carried / model.k_o,
        locked=(shift.offgoing,),
    )


def _is_recorded(log: ShiftLog, role: str, time: float) -> bool:
    """Return True if a channel is recorded at `time` [s]."""
    return role in log and bool(log[role].time[0] - _SPAN <= time <= log[role].time[-1])


def _fit_local(channel: Channel, time: float) -> _Local:
    """Polynomial fit over the first fresh samples from `time`; at least two are taken."""
    channel = channel.updates
    first = int(np.searchsorted(channel.time, time - 1e-9))
    count = max(2, int(np.searchsorted(channel.time, time + _SPAN) - first))
    t = channel.time[first : first + count] - time
    values = channel.values[first : first + count]
    degree = 2 if t.size >= _CURVED_FROM else min(1, t.size - 1)
    design = np.vander(t, degree + 1, increasing=True)
    coefficients: FloatArray = np.linalg.lstsq(design, values, rcond=None)[0].astype(np.float64)
    freedom = max(1, values.size - coefficients.size)
    scatter = float(np.sqrt(np.sum((values - design @ coefficients) ** 2) / freedom))
    # A few samples may by chance agree better than their noise allows.
    noise = max(scatter, estimate_white_noise(channel.values))
    floor = 1e-9 * (1.0 + float(np.abs(values).max()))
    return _Local(
        value=float(coefficients[0]),
        slope=float(coefficients[1]) if degree else 0.0,
        variance=max(noise**2 * float(np.linalg.pinv(design.T @ design)[0, 0]), floor**2),
        scatter=scatter,
    )
