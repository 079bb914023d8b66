# SPDX-License-Identifier: MIT
"""Logged shifts together with the calibration that they were driven with.

The commanded profile is the better input of a simulation: it has no noise, sampling or delay, and
what lies between it and the clutches is then one path of the inputs. A log has no channel for
it; but its pressures show the instant of the request, and whether they follow the profile at all.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.calibration.maneuver import Maneuver
from drivetwin.calibration.profiles import Profiles
from drivetwin.estimation.data.noise import prepare_signal
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.shifts.shift import get_shift_pressures
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.validation.simulate_log import LoggedShift

_COARSE, _FINE = 5e-3, 1e-4
"""Steps [s] in which the instant of the request is sought: a few samples, then a part of one."""
_RAMPS = 0.02
"""Share of the largest pressure by which a log may depart from its profile (RMS) beside its noise:
delays and lags of the hydraulics on the ramps, and errors of gain. Another calibration departs by
more."""

_STEADY = 0.3
"""Time [s] before the request over which the logged torque shows the driver's demand."""
_SAME_DEMAND = 0.01
"""Share of the torque up to which a difference of the demands is an error of the message."""


@dataclass(frozen=True, eq=False)
class DrivenShift:
    """A logged shift and the profiles that were commanded, on the clock of the log.

    Without `profiles` the shift is simulated from its logged torque and pressures. `request` [s] is
    the instant of the request; `calibration` names the file of the profiles. `misfit` is the RMS
    distance [Pa] of the logged pressures from the nearest profiles, None without any.
    """

    logged: LoggedShift
    profiles: Profiles | None = None
    request: float = 0.0
    calibration: str = ""
    misfit: float | None = None


def match_profiles(
    logged: LoggedShift, candidates: Mapping[str, Profiles], shift: Maneuver
) -> DrivenShift:
    """Find the commanded profiles of a logged shift and the instant of its request.

    Of the `candidates`, profiles by file on the clock of `shift`, those are taken that the logged
    pressures follow best. Where they follow none, the shift has no profiles.
    """
    names = (shift.offgoing.name, shift.oncoming.name)
    channels = {
        name: prepare_signal(one)
        for name, one in get_shift_pressures(logged.log, logged.shift).items()
    }
    pairs = {
        file: [(channels[names[0]], one.offgoing), (channels[names[1]], one.oncoming)]
        for file, one in candidates.items()
    }
    span = (logged.shift.before[0], logged.shift.lockup_time)
    found = {file: _align(pair, span, shift.horizon) for file, pair in pairs.items()}
    if not found:
        return DrivenShift(logged)
    file = min(found, key=lambda one: found[one][1])
    offset, misfit = found[file]
    largest = max(float(np.max(one.values)) for _, one in pairs[file])
    noise = max(one.sigma for one in channels.values())
    if misfit > np.hypot(noise, _RAMPS * largest):
        return DrivenShift(logged, misfit=misfit)
    moved = Profiles(*(_move(one, offset) for one in candidates[file].signals.values()))
    request = offset + shift.request
    return DrivenShift(logged, _follow_demand(moved, logged, request), request, file, misfit)


def _follow_demand(profiles: Profiles, logged: LoggedShift, request: float) -> Profiles:
    """Move the torque to the driver's demand of the log, where it is another one.

    Delay and lag do not act on the steady torque before the request.
    """
    torque, seen = profiles.engine_torque, prepare_signal(logged.log["engine_torque"])
    steady = (seen.time >= request - _STEADY) & (seen.time <= request)
    if not steady.any():
        return profiles
    wanted = np.interp(seen.time[steady], torque.time, torque.values)
    more = float(np.mean(seen.values[steady] - wanted))
    if abs(more) <= _SAME_DEMAND * float(np.max(np.abs(torque.values))):
        return profiles
    return replace(profiles, engine_torque=replace(torque, values=torque.values + more))


def _move(signal: Signal, offset: float) -> Signal:
    return replace(signal, time=np.asarray(signal.time) + offset)


def _align(
    pairs: Sequence[tuple[MeasuredSignal, Signal]], span: tuple[float, float], horizon: float
) -> tuple[float, float]:
    """Return the offset [s] of the log's clock and the RMS distance [Pa] at it."""

    def measure(offset: float) -> float:
        parts = []
        for channel, wanted in pairs:
            inside = (channel.time >= offset) & (channel.time <= offset + horizon)
            time = channel.time[inside]
            parts.append(
                channel.values[inside] - np.interp(time - offset, wanted.time, wanted.values)
            )
        every = np.concatenate(parts)
        return float(np.sqrt(np.mean(every**2))) if every.size else float("inf")

    coarse = np.arange(span[0] - 0.5 * horizon, span[1], _COARSE)
    best = float(coarse[int(np.argmin([measure(one) for one in coarse]))])
    fine = best + np.arange(-_COARSE, _COARSE, _FINE)
    values = [measure(one) for one in fine]
    place = int(np.argmin(values))
    return float(fine[place]), values[place]
