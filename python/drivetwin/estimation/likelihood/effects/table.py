# SPDX-License-Identifier: MIT
"""Table of all effects."""

from __future__ import annotations

from drivetwin.estimation.likelihood.effects import (
    aero_load,
    backlash,
    brake_drag,
    drum_inertia,
    efficiency_by_gear,
    friction_heat,
    friction_pressure,
    friction_shape,
    input_drag,
    input_shaft_mode,
    output_torque_delay,
    output_torque_drift,
    output_torque_offset,
    pressure_delay,
    progressive_shaft,
    slow_load,
    torque_lag,
    tyre_slip,
)
from drivetwin.estimation.likelihood.effects.effect import Effect
from drivetwin.estimation.result.cause import Group
from drivetwin.vehicle.effects import EffectId

EFFECTS: dict[EffectId, Effect] = {
    one.id: one
    for one in (
        efficiency_by_gear.EFFECT,
        input_drag.EFFECT,
        output_torque_offset.EFFECT,
        output_torque_drift.EFFECT,
        output_torque_delay.EFFECT,
        slow_load.EFFECT,
        aero_load.EFFECT,
        brake_drag.EFFECT,
        drum_inertia.EFFECT,
        pressure_delay.EFFECT,
        torque_lag.EFFECT,
        input_shaft_mode.EFFECT,
        tyre_slip.EFFECT,
        backlash.EFFECT,
        progressive_shaft.EFFECT,
        friction_shape.EFFECT,
        friction_pressure.EFFECT,
        friction_heat.EFFECT,
    )
}
"""Effects by name, in the order in which they are reported."""


def describe_group(group: Group) -> str:
    """Describe a cause in the field's words, with the element or gear that has it."""
    if group.effect is None:
        return f"a tolerance of a sensor ({group.subject})"
    meaning = EFFECTS[group.effect].meaning
    return f"{meaning} ({group.subject})" if group.subject else meaning
