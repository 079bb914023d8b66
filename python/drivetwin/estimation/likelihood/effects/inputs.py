# SPDX-License-Identifier: MIT
"""Effects in inputs: other times and other torques than logged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin._util.arrays import FloatArray, apply_lag
from drivetwin.estimation.likelihood.effects.effect import (
    Disturbance,
    Effect,
    OperatingPoint,
    WalkStream,
    build_random_walk,
    draw_walk,
)
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import SyntheticVehicle
from drivetwin.estimation.likelihood.torque_record import TORQUE
from drivetwin.likelihood.input_smoothing import smooth_adaptive
from drivetwin.likelihood.measured_signal import MeasuredSignal
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.vehicle.effects import EffectId


def build_pressure_delay(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Delay the pressure of each element, by the rate of the pressure without noise."""
    found = []
    for name, signal in at.record.pressures.items():
        sigma = at.record.input_sigma[name]
        steady = smooth_adaptive(MeasuredSignal(signal.time, signal.values, sigma))
        rate = at.compute_rate(np.interp(at.run.time, signal.time, steady))
        found.append(Disturbance(name, inputs={name: -std * rate}))
    return found


def apply_pressure_delay(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Delay the pressures; each has its first value before it starts."""
    pressures = {}
    for name, one in vehicle.pressures.items():
        time = np.concatenate([[one.time[0] - size], one.time])
        pressures[name] = Signal(time, np.concatenate([one.values[:1], one.values]), size)
    return replace(vehicle, pressures=pressures)


PRESSURE_DELAY = Effect(
    EffectId.PRESSURE_DELAY,
    "a clutch pressure that acts later than it is measured",
    "s",
    0.003,
    "typical range of lines between sensor port and piston and of filters of pressure sensors, 1 "
    "to 5 ms",
    "set time_shift_s of the pressure in the channel mapping and compare",
    build_pressure_delay,
    apply_pressure_delay,
    negative="negative: the measured pressure is late",
)


STEP_S = 2e-3
"""Raster [s] of the torque: a tenth of the usual lag."""
SMOOTHED = 0.5
"""Width of the moving mean before a torque is differentiated, over the lag: it removes noise and
hardly changes the response to a lag."""


def build_torque_lag(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Change the acting torque as a lag of `std` [s] does beyond a pure delay.

    With s the derivative by time, an acting torque that lags by τ > 0 is T/(1 + τs), one whose
    logged value lags by -τ is T·(1 - τs). The delay τ is an unknown of its own, so the change is
    (e^τs/(1 + τs) - 1)·T or ((1 - τs)·e^τs - 1)·T. To second order both are ±τ²/2·T''.
    """
    steady = at.record.engine_torque
    raster = np.arange(steady.time[0], steady.time[-1], STEP_S)
    if at.record.of_speeds is not None or raster.size < 2:
        return []
    torque = np.interp(raster, steady.time, steady.values)
    lagged = apply_lag(torque, STEP_S, std) if std > 0.0 else _remove_lag(torque, -std)
    delay = at.term.plant.get_value(at.point, "te_delay")
    change = np.interp(raster + std, raster, lagged) - torque
    return [Disturbance(inputs={TORQUE: np.interp(at.middle + delay, raster, change)})]


def _remove_lag(torque: FloatArray, lag: float) -> FloatArray:
    """Remove a first-order lag [s] from a torque (n,)."""
    width = 2 * int(0.5 * SMOOTHED * lag / STEP_S) + 1
    padded = np.pad(torque, width // 2, mode="edge")
    smooth = np.convolve(padded, np.ones(width) / width, "valid")
    return np.asarray(torque + lag * np.gradient(smooth, STEP_S))


def apply_torque_lag(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Apply the lag to the evenly sampled engine torque, at rest before its start."""
    logged = vehicle.engine_torque
    step = float(logged.time[1] - logged.time[0])
    lagged = Signal(logged.time, apply_lag(logged.values, step, size))
    return replace(vehicle, engine_torque=lagged)


TORQUE_LAG = Effect(
    EffectId.TORQUE_LAG,
    "a lag of the engine torque beside its delay",
    "s",
    0.02,
    "typical range of filters by which engine controllers send their torque, 10 to 30 ms",
    "record the engine torque unfiltered, or at a faster rate",
    build_torque_lag,
    apply_torque_lag,
    power=2.0,
    curved=True,
    signed=True,
    negative="negative: the logged engine torque lags the acting one",
)


MAP_COUNT = 4
"""Columns of the error of a torque map: waves of at least half the largest torque."""


def build_torque_map(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Add a random walk over the engine torque to the torque without its noise.

    Its part in proportion to the torque is a gain error, a constant part is drag at the input: both
    have entries of their own, and a torque that hardly varies shows no other part.
    """
    steady = at.record.engine_torque
    delay = at.term.plant.get_value(at.point, "te_delay")
    torque = np.interp(at.middle + delay, steady.time, steady.values)
    share = np.abs(torque) / at.largest_engine_torque
    columns = np.array(build_random_walk(share, MAP_COUNT, std * at.largest_engine_torque)).T
    line = np.column_stack([np.ones(share.size), share])
    columns -= line @ np.linalg.lstsq(line, columns)[0]
    return [Disturbance(inputs={TORQUE: -column}) for column in columns.T]


def apply_torque_map(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Add a random walk over the logged engine torque to the acting one."""
    logged, full = vehicle.engine_torque, vehicle.nominal.largest_engine_torque
    walk = draw_walk(WalkStream.TORQUE_MAP, vehicle.seed, 1.0)
    error = size * full * np.interp(np.abs(logged.values) / full, walk.time, walk.values)
    return replace(vehicle, engine_torque=replace(logged, values=logged.values + error))


TORQUE_MAP = Effect(
    EffectId.TORQUE_MAP,
    "an error of the engine torque over its own value",
    "of the largest engine torque",
    0.01,
    "engineering estimate: torque models of engine controllers and maps between their points, of "
    "the order of one per cent over the range",
    "compare the engine torque with a torque meter at several loads",
    build_torque_map,
    apply_torque_map,
    random=True,
)


EFFECTS = (PRESSURE_DELAY, TORQUE_LAG, TORQUE_MAP)
