# SPDX-License-Identifier: MIT
"""Effects that the dual-clutch model leaves out, by name, and what a card states of them."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum


class EffectId(StrEnum):
    """Departure of a vehicle or a sensor from the dual-clutch model."""

    EFFICIENCY_BY_GEAR = "efficiency_by_gear"
    INPUT_DRAG = "input_drag"
    OUTPUT_TORQUE_OFFSET = "output_torque_offset"
    OUTPUT_TORQUE_DRIFT = "output_torque_drift"
    OUTPUT_TORQUE_DELAY = "output_torque_delay"
    SLOW_LOAD = "slow_load"
    AERO_LOAD = "aero_load"
    DRUM_INERTIA = "drum_inertia"
    PRESSURE_DELAY = "pressure_delay"
    TORQUE_LAG = "torque_lag"
    INPUT_SHAFT_MODE = "input_shaft_mode"
    TYRE_SLIP = "tyre_slip"
    BACKLASH = "backlash"
    PROGRESSIVE_SHAFT = "progressive_shaft"
    FRICTION_SHAPE = "friction_shape"
    FRICTION_PRESSURE = "friction_pressure"
    FRICTION_HEAT = "friction_heat"
    SENSOR_TOLERANCE = "sensor_tolerance"


@dataclass(frozen=True)
class EffectPrior:
    """Normal prior of an effect in its unit; `std` 0 states it as known, with `value` 0 as none."""

    std: float
    value: float = 0.0

    @property
    def is_off(self) -> bool:
        """True if the effect is stated not to exist."""
        return self.std == 0.0 and self.value == 0.0
