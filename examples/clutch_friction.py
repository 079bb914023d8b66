# SPDX-License-Identifier: MIT
"""Two coefficients of a clutch's friction from two speeds: MathWorks' public example, solved.

The problem is the one of "Clutch Friction Coefficient Estimation" in the documentation of Simulink
Design Optimization: two inertias coupled by a clutch; a constant torque turns inertia 1, inertia 2
stands still and is taken along as the pressure rises. The friction coefficient is C1 at no slip and
C2 at 10 rad/s, linear in between. C1 and C2 are unknown; the speeds of both inertias are measured,
in one experiment for the estimation (pressure up and down again) and in one for validation
(pressure periodic). Its numbers are not published as text, so these are our own.

    J1·ω1' = T - T_c       J2·ω2' = T_c       T_c = μ(s)·gain·P,  s = ω1 - ω2

Data: a run of the model, with noise. Estimate: least squares with exact sensitivities
through the moments at which the clutch locks and breaks away, from start values twice too high.

    python -m examples.clutch_friction
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from drivetwin import Model
from drivetwin.modeling.model_components import Plates
from drivetwin.simulation.dual_clutch import FrictionTable, Signal
from drivetwin.simulation.network import Output

FloatArray = NDArray[np.float64]

TRUTH = (0.30, 0.22)
"""C1 at 0 rad/s and C2 at 10 rad/s."""
START = (0.60, 0.44)
SLIP = (0.0, 10.0)
NODES, INERTIAS = ("1", "2"), (1.2, 0.8)
SPEEDS: list[Output] = [("speed", node) for node in NODES]
TORQUE = 20.0
GAIN = 3.0e-4
"""Friction radius times area times surfaces [m^3]."""
NOISE = 0.05
"""Standard deviation of each speed [rad/s]."""
DURATION, RATE = 3.0, 200.0
UNKNOWNS = ("C.friction.mu.0", "C.friction.mu.1")
"""Paths of the unknowns: points 0 and 1 of the clutch's table."""


@dataclass(frozen=True)
class Experiment:
    """Pressure over time, and both speeds (n, 2) [rad/s] at `time` (n,) [s]."""

    time: FloatArray
    pressure: Signal
    speeds: FloatArray


@dataclass(frozen=True)
class Solution:
    """C1 and C2 with their standard errors, and the rms misfit of the validation [rad/s]."""

    estimate: FloatArray
    std: FloatArray
    validation: float


def ramps() -> Signal:
    """Up to 1.6 bar and down again: the clutch slips, locks, and slips again."""
    return Signal(np.array([0.0, 0.2, 1.4, 2.6, 3.0]), np.array([0.0, 0.0, 1.6e5, 0.3e5, 0.3e5]))


def periodic() -> Signal:
    """Between 0 and 1.2 bar, a period a second."""
    time = np.linspace(0.0, DURATION, 601)
    return Signal(time, 0.6e5 * (1.0 - np.cos(2.0 * np.pi * time)))


def build(coefficients: Sequence[float], pressure: Signal) -> Model:
    """Build two inertias at rest with a clutch between them."""
    model = Model("clutch bench")
    for node, inertia in zip(NODES, INERTIAS, strict=True):
        model.inertia(f"inertia {node}", inertia, node)
    model.torque("drive", NODES[0], TORQUE)
    plates = Plates(FrictionTable(SLIP, tuple(coefficients)), gain=GAIN)
    model.clutch("C", *NODES, pressure=pressure, plates=plates)
    model.start(dict.fromkeys(NODES, 0.0))
    return model


def recorded(pressure: Signal, seed: int) -> Experiment:
    """Simulate an experiment, with noise on both speeds."""
    time = np.arange(int(DURATION * RATE) + 1) / RATE
    run = build(TRUTH, pressure).simulate(time, record=SPEEDS)
    exact = np.column_stack([run[speed] for speed in SPEEDS])
    noise = NOISE * np.random.default_rng(seed).standard_normal(exact.shape)
    return Experiment(time, pressure, exact + noise)


def linearised(coefficients: FloatArray, seen: Experiment) -> tuple[FloatArray, FloatArray]:
    """Misfit of both speeds (2n,) and its exact derivatives (2n, 2) by C1 and C2."""
    model = build(coefficients.tolist(), seen.pressure)
    found = model.differentiate(seen.time, UNKNOWNS, record=SPEEDS)
    misfit = np.concatenate([found.run.columns[speed] for speed in SPEEDS]) - seen.speeds.T.ravel()
    return misfit, np.concatenate([found.derivatives[speed] for speed in SPEEDS])


def solve(seed: int = 0) -> Solution:
    """Estimate C1 and C2 from the ramps and validate them on the periodic pressure."""
    seen = recorded(ramps(), seed)

    def misfit(coefficients: FloatArray) -> FloatArray:
        return linearised(coefficients, seen)[0]

    def slopes_at(coefficients: FloatArray) -> FloatArray:
        return linearised(coefficients, seen)[1]

    found = least_squares(misfit, START, jac=slopes_at, bounds=(0.01, 2.0), x_scale=0.1)
    estimate = np.asarray(found.x, dtype=np.float64)
    _, slopes = linearised(estimate, seen)
    covariance = NOISE**2 * np.linalg.inv(slopes.T @ slopes)
    other = recorded(periodic(), seed + 1)
    validation, _ = linearised(estimate, other)
    return Solution(estimate, np.sqrt(np.diag(covariance)), float(np.sqrt(np.mean(validation**2))))


def main() -> None:
    """Print the solution beside the truth."""
    solution = solve()
    for name, truth, value, std in zip(
        ("C1", "C2"), TRUTH, solution.estimate, solution.std, strict=True
    ):
        print(f"{name} = {value:.4f} ± {1.96 * std:.4f} (95 %), true {truth:.2f}")
    print(f"validation: rms {solution.validation:.3f} rad/s, noise {NOISE:.3f} rad/s")


if __name__ == "__main__":
    main()
