# SPDX-License-Identifier: MIT
"""Initial state, command pressures and identified range of a simulated log."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.channels.roles import make_command_role, make_pressure_role
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.errors import MissingChannelError, MissingParameterError, Where
from drivetwin.estimation.data.actuators import compute_pressure_channel
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.likelihood.measured_signal import estimate_white_noise
from drivetwin.shifts.shift import Shift
from drivetwin.simulation.dual_clutch import DualClutch, State, Trajectory
from drivetwin.twin.twin import Twin


def replace_pressures(twin: Twin, log: ShiftLog) -> tuple[ShiftLog, tuple[str, ...]]:
    """Return the log with the pressures that follow from its commands, and their elements.

    Pressures of other elements stay as measured. Raises MissingParameterError where the twin has no
    actuator, and MissingChannelError where the log has no command to any of them.
    """
    if not twin.actuators:
        raise MissingParameterError(
            "the twin has no model of an actuator",
            "identify from a log with commanded pressures (role "
            "pressure_command.<element>), or state [elements.<name>.actuator] on the vehicle card",
            Where(file=twin.name),
        )
    made = {
        name: compute_pressure_channel(log[make_command_role(name)], one.model, name)
        for name, one in twin.actuators.items()
        if make_command_role(name) in log
    }
    if not made:
        roles = ", ".join(map(make_command_role, twin.actuators))
        raise MissingChannelError(
            f"the log has no commanded pressure: none of {roles}",
            "name the columns in a channel mapping file (--channels)",
            Where(file=log.source),
        )
    pressures = {make_pressure_role(name): channel for name, channel in made.items()}
    return replace(log, channels={**log.channels, **pressures}), tuple(made)


CARRIES = 0.02
"""Share of a run's largest clutch torque from which an element's slip asks for its friction."""


def name_ends(
    reached: tuple[float, float], limits: tuple[float, float], unit: str
) -> dict[str, Number]:
    """Return the ends of the range reached by a run and of its limits, for a finding."""
    names = ("low", "high", "limit_low", "limit_high")
    return {n: Number(x, unit) for n, x in zip(names, (*reached, *limits), strict=True)}


def collect_loaded_slip(run: Trajectory) -> list[FloatArray]:
    """|slip| of each element while it carries torque [rad/s]; an open one may turn at any speed."""
    torques = {name: np.abs(torque) for name, torque in run.clutch_torque.items()}
    least = CARRIES * max(float(np.nanmax(torque)) for torque in torques.values())
    return [np.abs(slip[torques[name] > least]) for name, slip in run.slip.items()]


_RANGES = {"slip": "rad/s", "pressure": "Pa", "torque": "N*m", "speed": "rad/s"}
"""Units of what a twin has a range of."""


def check_range(
    name: str, arrays: list[FloatArray], limits: tuple[float, float], place: Where | None = None
) -> list[Finding]:
    """Return a finding where arrays of quantity `name` leave the range identified."""
    if (reached := find_range_excess(arrays, limits)) is None:
        return []
    ends = name_ends(reached, limits, _RANGES[name])
    return [report(Code.OUTSIDE_IDENTIFIED_RANGE, name, place, **ends)]


def find_range_excess(
    arrays: list[FloatArray], limits: tuple[float, float]
) -> tuple[float, float] | None:
    """Least and greatest value; None where no value lies clearly beyond the limits."""
    values = np.concatenate(arrays)
    values = values[np.isfinite(values)]
    if values.size == 0:
        return None
    low, high = float(values.min()), float(values.max())
    margin = 0.02 * (limits[1] - limits[0])
    if low >= limits[0] - margin and high <= limits[1] + margin:
        return None
    return low, high


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
