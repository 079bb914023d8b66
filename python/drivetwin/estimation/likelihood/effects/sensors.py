# SPDX-License-Identifier: MIT
"""Effects in sensors: errors of recorded outputs, which leave the motion as it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin._util.arrays import integrate_trapezoids
from drivetwin.estimation.likelihood.effects.effect import (
    Disturbance,
    Effect,
    OperatingPoint,
    WalkStream,
    build_random_walk,
    draw_walk,
)
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import (
    SyntheticVehicle,
    filter_torque,
)
from drivetwin.estimation.likelihood.torque_record import OUTPUT_TORQUE, get_columns
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.vehicle.effects import EffectId


def build_output_torque_offset(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Add a constant to the output torque."""
    offset = np.full(at.run.time.size, std * at.largest_shaft_torque)
    return [Disturbance(outputs={OUTPUT_TORQUE: offset})]


def apply_output_torque_offset(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Add the offset to the error of the sensor."""
    error = vehicle.errors
    offset = error.offset + size * vehicle.nominal.largest_shaft_torque
    return replace(vehicle, errors=replace(error, offset=offset))


OUTPUT_TORQUE_OFFSET = Effect(
    EffectId.OUTPUT_TORQUE_OFFSET,
    "an offset of the output torque",
    "of the largest shaft torque",
    0.001,
    "typical range of the zero error of torque flanges and telemetry, 0.1 to 0.3 % of full scale",
    "zero the output torque sensor with the driveline unloaded",
    build_output_torque_offset,
    apply_output_torque_offset,
    on_sensor=True,
)


COUNT = 4
"""Columns of the walk: drift slower than an eighth of the span is what moves parameters."""
REFERENCE_S = 5.0
"""Time [s] over which the prior states the drift."""


def build_output_torque_drift(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Add a random walk to the output torque of the shift."""
    growth = std * at.largest_shaft_torque * float(np.sqrt(at.duration / REFERENCE_S))
    columns = build_random_walk(at.progress, COUNT, growth)
    label = at.describe_shift()
    return [Disturbance(label, outputs={OUTPUT_TORQUE: column}) for column in columns]


def apply_output_torque_drift(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Add a random walk to the error of the sensor."""
    duration = float(vehicle.nominal.trajectory.time[-1])
    walk = draw_walk(WalkStream.OUTPUT_TORQUE, vehicle.seed, duration)
    scale = size * vehicle.nominal.largest_shaft_torque / np.sqrt(REFERENCE_S)
    drift = Signal(walk.time, scale * walk.values)
    return replace(vehicle, errors=replace(vehicle.errors, drift=drift))


OUTPUT_TORQUE_DRIFT = Effect(
    EffectId.OUTPUT_TORQUE_DRIFT,
    "a drift of the output torque",
    "of the largest shaft torque over 5 s",
    0.003,
    "typical range of strain gauges on a shaft by warm-up and bending crosstalk, 0.1 to 0.5 % of "
    "full scale",
    "let the torque sensor warm up and compare its zero before and after the recording",
    build_output_torque_drift,
    apply_output_torque_drift,
    random=True,
    on_sensor=True,
)


def build_output_torque_delay(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Delay the simulated output torque; the speeds are the reference clock."""
    time, torque = at.run.time, at.run.shaft_torque
    return [Disturbance(outputs={OUTPUT_TORQUE: np.interp(time - std, time, torque) - torque})]


def apply_output_torque_delay(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Delay the sensor."""
    return replace(vehicle, errors=replace(vehicle.errors, delay=size))


OUTPUT_TORQUE_DELAY = Effect(
    EffectId.OUTPUT_TORQUE_DELAY,
    "a delay of the output torque against the speeds",
    "s",
    0.003,
    "typical range of anti-aliasing filters and telemetry of torque sensors, 1 to 5 ms",
    "set channels.output_torque.time_shift_s in the channel mapping and compare",
    build_output_torque_delay,
    apply_output_torque_delay,
    curved=True,
    signed=True,
    on_sensor=True,
    negative="negative: the output torque is early",
)


def build_output_torque_filter(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Filter the simulated output torque; the speeds are the reference clock."""
    time, torque = at.run.time, at.run.shaft_torque
    change = np.sign(std) * (filter_torque(time, torque, abs(std)) - torque)
    return [Disturbance(outputs={OUTPUT_TORQUE: change})]


def apply_output_torque_filter(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Put a filter behind the sensor."""
    return replace(vehicle, errors=replace(vehicle.errors, filter_delay=size))


OUTPUT_TORQUE_FILTER = Effect(
    EffectId.OUTPUT_TORQUE_FILTER,
    "a low-pass filter of the output torque",
    "s",
    0.003,
    "typical range of anti-aliasing filters and telemetry of torque sensors, 1 to 5 ms of delay: a "
    "Butterworth of order 2 at 45 to 225 Hz",
    "record the output torque with a faster filter, or all channels with the same one",
    build_output_torque_filter,
    apply_output_torque_filter,
    curved=True,
    on_sensor=True,
)


def build_output_torque_curve(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Add an error that grows with the square of the output torque."""
    torque = at.run.shaft_torque
    error = std * torque * np.abs(torque) / at.largest_shaft_torque
    return [Disturbance(outputs={OUTPUT_TORQUE: error})]


def apply_output_torque_curve(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Curve the sensor."""
    curve = size / vehicle.nominal.largest_shaft_torque
    return replace(vehicle, errors=replace(vehicle.errors, curve=curve))


OUTPUT_TORQUE_CURVE = Effect(
    EffectId.OUTPUT_TORQUE_CURVE,
    "a curved characteristic of the output torque sensor",
    "of the largest shaft torque",
    0.005,
    "typical range of the linearity of shafts with strain gauges, 0.1 to 1 % of full scale",
    "calibrate the output torque sensor at several torques up to the largest",
    build_output_torque_curve,
    apply_output_torque_curve,
    on_sensor=True,
)


def build_speed_run_out(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Add a sine and a cosine of the angle of its shaft to each speed."""
    run, found = get_columns(at.run), []
    for name in dict.fromkeys(out.name for out in at.record.outputs):
        if name == OUTPUT_TORQUE:
            continue
        angle = integrate_trapezoids(run[name], at.run.time)
        for wave in (np.sin(angle), np.cos(angle)):
            error = std * run[name] * wave
            found.append(Disturbance(name.replace("_", " "), outputs={name: error}))
    return found


def apply_speed_run_out(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Mount the wheel of the speed sensor at the engine off its centre."""
    return replace(vehicle, errors=replace(vehicle.errors, run_out=size))


SPEED_RUN_OUT = Effect(
    EffectId.SPEED_RUN_OUT,
    "a speed error once per turn, as of a tooth wheel off its centre",
    "of the speed",
    5e-4,
    "typical range of tooth wheels: an eccentricity of 0.02 to 0.1 mm on a radius of 100 mm",
    "average the speed over whole turns, or centre the tooth wheel",
    build_speed_run_out,
    apply_speed_run_out,
    random=True,
    on_sensor=True,
)


EFFECTS = (
    OUTPUT_TORQUE_OFFSET,
    OUTPUT_TORQUE_DRIFT,
    OUTPUT_TORQUE_DELAY,
    OUTPUT_TORQUE_CURVE,
    SPEED_RUN_OUT,
    OUTPUT_TORQUE_FILTER,
)
