# SPDX-License-Identifier: MIT
"""Second torsional mode of the input side: engine and gearbox input as two masses."""

from __future__ import annotations

from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint
from drivetwin.vehicle.effects import EffectId


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Build no column: k_o absorbs a mode before it shows, so it is tried in the plant alone."""
    del at, std
    return []


EFFECT = Effect(
    EffectId.INPUT_SHAFT_MODE,
    "a second torsional mode at the gearbox input",
    "Hz",
    50.0,
    "middle of the typical range of torsional dampers and input shafts of trucks and cars, 20 to "
    "130 Hz with the gearbox held",
    "the mode moves k_o, c_o and J′: compare its frequency with that of the torsional damper",
    build,
    has_columns=False,
)
