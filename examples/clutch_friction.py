# SPDX-License-Identifier: MIT
"""Two coefficients of a clutch's friction from two speeds: MathWorks' public example, solved.

The problem is the one of "Clutch Friction Coefficient Estimation" in the documentation of Simulink
Design Optimization: two inertias coupled by a clutch; a constant torque turns inertia 1, inertia 2
stands still and is taken along as the pressure rises. The friction coefficient is C1 at no slip and
C2 at 10 rad/s, linear in between. C1 and C2 are unknown; the speeds of both inertias are measured,
in one experiment for the estimation (pressure up and down again) and in one for validation
(pressure periodic). Its numbers are not published as text, so these are our own.

    J1·ω1' = T - T_c       J2·ω2' = T_c       T_c = μ(s)·gain·P,  s = ω1 - ω2

Data: the network of elements, with noise. Estimate: least squares with exact sensitivities
through the moments at which the clutch locks and breaks away, from start values twice too high.

    python -m examples.clutch_friction
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from drivetwin.simulation import network
from drivetwin.simulation.dual_clutch import (
    DualClutch,
    FrictionTable,
    RoadLoad,
    ShiftElement,
    Signal,
    State,
)
from drivetwin.simulation.dual_clutch_sensitivity import simulate_sensitivities

FloatArray = NDArray[np.float64]

TRUTH = (0.30, 0.22)
"""C1 at 0 rad/s and C2 at 10 rad/s."""
START = (0.60, 0.44)
SLIP = (0.0, 10.0)
INERTIAS = (1.2, 0.8)
TORQUE = 20.0
GAIN = 3.0e-4
"""Friction radius times area times surfaces [m^3]."""
NOISE = 0.05
"""Standard deviation of each speed [rad/s]."""
DURATION, RATE = 3.0, 200.0
NAMES = ("C.mu.0", "C.mu.1")
"""The unknowns as the core calls them: points 0 and 1 of the clutch's table."""


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


def recorded(pressure: Signal, seed: int) -> Experiment:
    """An experiment on the network of two inertias and a clutch, with noise on both speeds."""
    elements: list[network.Element] = [
        {"type": "torque", "name": "drive", "node": "1", "input": "torque"},
        {"type": "inertia", "name": "inertia 1", "node": "1", "inertia": INERTIAS[0]},
        {"type": "inertia", "name": "inertia 2", "node": "2", "inertia": INERTIAS[1]},
        {
            "type": "clutch", "name": "C", "a": "1", "b": "2", "gain": GAIN, "p0": 0.0, "peak": 1.0,
            "pressure": "pressure", "drum_inertia": 0.0,
            "friction": {"slip": list(SLIP), "mu": list(TRUTH), "extend": False},
        },
    ]  # fmt: skip
    time = np.arange(int(DURATION * RATE) + 1) / RATE
    torque = Signal(time[[0, -1]], np.full(2, TORQUE))
    run = network.simulate(
        elements,
        {"torque": torque, "pressure": pressure},
        network.Start({"1": 0.0, "2": 0.0}),
        time,
        [("speed", "1"), ("speed", "2")],
    )
    exact = np.column_stack([run.columns["speed", node] for node in ("1", "2")])
    noise = NOISE * np.random.default_rng(seed).standard_normal(exact.shape)
    return Experiment(time, pressure, exact + noise)


def model(coefficients: FloatArray) -> DualClutch:
    """The same as a driveline whose output shaft carries nothing."""
    clutch = ShiftElement(
        "C", 1.0, 1.0, GAIN, 0.0, FrictionTable(SLIP, tuple(coefficients.tolist()))
    )
    nothing = RoadLoad()
    return DualClutch(
        J1=INERTIAS[0], J2e=0.0, eta=1.0, loss_law="paper", i_in=1.0, J_out=INERTIAS[1], i_f=1.0,
        J_v=1.0, k_o=1e-9, c_o=0.0, load=nothing, elements=(clutch,),
    )  # fmt: skip


def linearised(coefficients: FloatArray, seen: Experiment) -> tuple[FloatArray, FloatArray]:
    """Misfit of both speeds (2n,) and its exact derivatives (2n, 2) by C1 and C2."""
    torque = Signal(seen.time[[0, -1]], np.full(2, TORQUE))
    found = simulate_sensitivities(
        model(coefficients),
        torque,
        {"C": seen.pressure},
        State(0.0, 0.0, 0.0, 0.0),
        seen.time,
        NAMES,
    )
    run = found.run
    misfit = np.concatenate([run.engine_speed, run.output_speed]) - seen.speeds.T.ravel()
    slopes = [found.derivatives[name] for name in NAMES]
    return misfit, np.column_stack(
        [np.concatenate([each.engine_speed, each.output_speed]) for each in slopes]
    )


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
