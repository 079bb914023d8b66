# SPDX-License-Identifier: MIT
"""Second torsional mode of the input side: engine and gearbox input as two masses."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.effects.effect import Disturbance, Effect
from drivetwin.estimation.likelihood.effects.extended_response import (
    CutForce,
    build_extended_rates,
    solve_extended,
)
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint
from drivetwin.vehicle.effects import EffectId

FREQUENCIES_HZ = (28.0, 36.0, 46.0, 60.0, 80.0, 110.0)
"""Frequencies of the mode with the gearbox held; neighbours overlap by their damping."""
DAMPING = 0.06
"""Damping ratio of the mode, usual for a torsional damper."""
SHARE = 0.5
"""Share of the engine's inertia in front of the compliance."""
START_STEPS = 5
"""Steps over which the initial twist of the compliance is averaged."""


def build(at: OperatingPoint, std: float) -> list[Disturbance]:
    """Build the response to each mode as a group of its own; only one acts at a time."""
    return [
        Disturbance(f"{one:.0f} Hz", respond=partial(_respond, at, one, std))
        for one in FREQUENCIES_HZ
    ]


def _respond(at: OperatingPoint, frequency: float, amount: float) -> FloatArray:
    """Compute the change of the state (N, 4) for `amount` times a mode that half of J1
    stands in front of.

    States beyond the four of the driveline: twist φ of the compliance and its rate ν. The torque
    in the cut is k·φ + c·ν, in the rigid run T_e - J1a·ω_e'.
    """
    front, behind = SHARE * at.model.J1, (1.0 - SHARE) * at.model.J1
    pulsation = 2.0 * np.pi * frequency
    k = pulsation**2 / (1.0 / front + 1.0 / behind)
    c = 2.0 * DAMPING * k / pulsation
    reduced = replace(at.model, J1=behind)
    count, (twist, rate) = at.middle.size, (4, 5)
    row = np.zeros((count, 6))
    row[:, twist], row[:, rate] = k, c
    rigid = at.engine_torque - front * at.compute_rate(at.run.engine_speed)
    gain = np.full(count, at.model.get_efficiency(driving=True))
    rates = build_extended_rates(at, reduced, CutForce(0, row, gain, rigid))
    rates.matrix[:, twist, rate] = 1.0
    rates.matrix[:, rate] = -row / front - rates.matrix[:, 0]
    rates.drive[:, rate] = rigid / front - rates.drive[:, 0]
    start = np.zeros(6)
    start[twist] = np.mean(rigid[:START_STEPS]) / k
    return amount * solve_extended(at, reduced, rates, start)


EFFECT = Effect(
    EffectId.INPUT_SHAFT_MODE,
    "a second torsional mode at the gearbox input",
    "of a mode with half of the engine's inertia in front of it",
    0.7,
    "typical range of torsional dampers and input shafts of trucks and cars, modes at 30 to 100 Hz",
    "the mode moves k_o, c_o and J′: state the input shaft, or record without its excitation",
    build,
)
