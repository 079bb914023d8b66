# SPDX-License-Identifier: MIT
"""Efficiency that differs between the gears of a shift."""

from __future__ import annotations

from drivetwin.estimation.likelihood.data.shift_record import TORQUE
from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint
from drivetwin.vehicle.effects import EffectId


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Change the torque of the engine by what another η passes on in the gear that is entered.

    The model's η is that of the gear that is left. The share of the on-coming element blends both.
    """
    driveline = at.part.structure.driveline
    torque = at.engine_torque - at.model.J1 * at.compute_rate(at.run.engine_speed)
    change = std * torque * at.oncoming_share / at.model.eta
    subject = f"{driveline.i_before:.4g} to {driveline.i_after:.4g}"
    return [Disturbance(subject, inputs={TORQUE: change})]


EFFECT = Effect(
    EffectId.EFFICIENCY_BY_GEAR,
    "an efficiency that differs between the gears",
    "1",
    0.01,
    "typical loss of one more gear mesh in the power flow, 0.5 to 1.5 %; see Niemann and Winter, "
    "Maschinenelemente II, on losses of gears",
    "state eta for one gear on the card, or identify each gear from pedal steps in it",
    build,
)
