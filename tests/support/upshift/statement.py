# SPDX-License-Identifier: MIT
"""The problem that every program solves: one power-on upshift of a dual-clutch driveline.

    J_e ω_e'     = η T_e - Σ α_k τ_k               α_k = 1/(i_in i_ck)
    J_out ω_out' = Σ i_out,k τ_k - T_o
    J_v ω_w'     = i_f T_o - T_v                   T_o = k θ + c θ',  θ' = ω_out - i_f ω_w
    |τ_k| ≤ μ(|s_k|) gain_k max(0, P_k - P0)       s_k = α_k ω_e - i_out,k ω_out
    μ(s) = mu_c + (mu_s - mu_c) exp(-s/v_s) + mu_v s

1.5 s from steady acceleration with the first clutch locked. Engine torque and both pressures are
samples at 1 kHz, linear in between, with a 22 Hz ripple and noise of a fixed seed. Wanted are ω_e,
ω_out, ω_w and T_o at every sample, and the times of all changes of state: the second clutch fills,
the first breaks away and vents, the second locks; then the shaft oscillates at 12 Hz.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.support.arrays import FloatArray

BAR = 1e5
STEP, SAMPLES = 1e-3, 1501
_LENGTH = STEP * (SAMPLES - 1)


@dataclass(frozen=True)
class Problem:
    """Parameters of the equations, SI; pairs are of the off-going and the on-coming clutch.

    `speed` is that of the engine at the start.
    """

    J_e: float = 17.5
    J_out: float = 1.5
    J_v: float = 6000.0
    eta: float = 0.85
    i_in: float = 1.0
    i_c: tuple[float, float] = (1.4, 0.95)
    i_out: tuple[float, float] = (1.6, 1.6)
    i_f: float = 6.0
    T_v: float = 13800.0
    k: float = 0.0
    c: float = 0.0
    gain: tuple[float, float] = (3200.0 / (0.12 * 9.2) / BAR, 5200.0 / (0.12 * 9.2) / BAR)
    P0: tuple[float, float] = (0.8 * BAR, 0.8 * BAR)
    mu_s: float = 0.145
    mu_c: float = 0.12
    v_s: float = 6.0
    mu_v: float = 1e-4
    speed: float = 185.0


@dataclass(frozen=True)
class Inputs:
    """Engine torque [N m] and pressures [Pa] at `time` (n,) [s]."""

    time: FloatArray
    torque: FloatArray
    pressures: tuple[FloatArray, FloatArray]


@dataclass(frozen=True)
class Solution:
    """`columns` (4, n): ω_e, ω_out, ω_w [rad/s], T_o [N m] on the samples; `events` (m,) [s]."""

    columns: FloatArray
    events: FloatArray


def make_problem() -> Problem:
    """Return the problem; its shaft oscillates at 12 Hz with ζ = 0.05 in the new gear."""
    bare = Problem()
    before = bare.J_e * (bare.i_in * bare.i_c[1] * bare.i_out[1]) ** 2 + bare.J_out
    inertia = 1.0 / (1.0 / before + bare.i_f**2 / bare.J_v)
    zeta, damped = 0.05, 2.0 * np.pi * 12.0
    natural = damped / np.sqrt(1.0 - zeta**2)
    stiffness = inertia * natural**2
    damping = 2.0 * zeta * np.sqrt(inertia * stiffness)
    return Problem(k=float(stiffness), c=float(damping))


def make_inputs() -> Inputs:
    """Return the samples; the order in which noise is drawn is part of the statement."""
    time: FloatArray = STEP * np.arange(SAMPLES, dtype=np.float64)
    noise = np.random.default_rng(7)
    torque = _interpolate(
        time,
        (0.0, 0.55, 0.70, 0.80, 0.95, 1.05, 1.15, _LENGTH),
        (1400.0, 1400.0, 1400.0, 1150.0, 1150.0, 1250.0, 1400.0, 1400.0),
    )
    torque = torque + 6.0 * noise.standard_normal(SAMPLES)
    leaving = _interpolate(
        time,
        (0.0, 0.45, 0.50, 0.56, 0.61, 0.64, _LENGTH),
        (10.0, 10.0, 6.5, 5.0, 1.6, 0.0, 0.0),
    )
    coming = _interpolate(
        time,
        (0.0, 0.40, 0.45, 0.50, 0.54, 0.62, 0.72, 0.80, 1.02, 1.12, 1.2, _LENGTH),
        (0.0, 0.0, 1.4, 0.9, 0.9, 3.0, 6.0, 6.3, 6.4, 6.8, 10.0, 10.0),
    )
    window = np.clip((time - 0.70) / 0.05, 0.0, 1.0) * np.clip((1.1 - time) / 0.05, 0.0, 1.0)
    ripple = 0.25 * np.sin(2.0 * np.pi * 22.0 * time) * window
    coming = _add_disturbance(coming, ripple + 0.01 * noise.standard_normal(SAMPLES))
    leaving = _add_disturbance(leaving, 0.01 * noise.standard_normal(SAMPLES))
    return Inputs(time, torque, (BAR * leaving, BAR * coming))


def start(of: Problem, given: Inputs) -> tuple[float, float, float, float]:
    """Return ω_e, ω_out, ω_w [rad/s] and T_o [N m]: steady acceleration, first clutch locked."""
    ratio = of.i_in * of.i_c[0] * of.i_out[0]
    engine, vehicle = of.speed, of.J_v / of.i_f**2
    inertia = of.J_e * ratio**2 + of.J_out + vehicle
    acceleration = (float(given.torque[0]) * of.eta * ratio - of.T_v / of.i_f) / inertia
    output = engine / ratio
    return engine, output, output / of.i_f, vehicle * acceleration + of.T_v / of.i_f


def _interpolate(
    time: FloatArray, corners: tuple[float, ...], values: tuple[float, ...]
) -> FloatArray:
    return np.asarray(np.interp(time, corners, values), dtype=np.float64)


def _add_disturbance(level: FloatArray, disturbance: FloatArray) -> FloatArray:
    """Add the disturbance wherever there is pressure; never below zero [bar]."""
    return np.clip(np.where(level > 0.0, level + disturbance, 0.0), 0.0, None)
