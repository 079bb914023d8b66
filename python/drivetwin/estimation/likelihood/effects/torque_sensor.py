# SPDX-License-Identifier: MIT
"""Errors of the output torque sensor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.estimation.likelihood.data.shift_record import OUTPUT_TORQUE
from drivetwin.estimation.likelihood.effects.effect import (
    Disturbance,
    Effect,
    OperatingPoint,
    WalkStream,
    build_random_walk,
    draw_walk,
)
from drivetwin.estimation.likelihood.effects.synthetic_vehicle import SyntheticVehicle
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.vehicle.effects import EffectId


def build_output_torque_offset(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Add a constant to the output torque."""
    offset = np.full(at.run.time.size, std * at.largest_shaft_torque)
    return [Disturbance(outputs={OUTPUT_TORQUE: offset})]


def apply_output_torque_offset(vehicle: SyntheticVehicle, size: float) -> SyntheticVehicle:
    """Add the offset to the error of the sensor."""
    error = vehicle.output_torque
    offset = error.offset + size * vehicle.nominal.largest_shaft_torque
    return replace(vehicle, output_torque=replace(error, offset=offset))


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
    return replace(vehicle, output_torque=replace(vehicle.output_torque, drift=drift))


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
    return replace(vehicle, output_torque=replace(vehicle.output_torque, delay=size))


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


EFFECTS = (OUTPUT_TORQUE_OFFSET, OUTPUT_TORQUE_DRIFT, OUTPUT_TORQUE_DELAY)
