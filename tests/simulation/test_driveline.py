# SPDX-License-Identifier: MIT
"""The network of a driveline with effects against its equations, solved by SciPy in 2nd gear."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.simulation.dual_clutch import Trajectory
from tests.support.arrays import FloatArray

SCENARIO = load_scenario("paper_steps")
MODEL, RATIO = SCENARIO.model, 1.91
END = 1.9
FREQUENCY, SLIP, DRAG, BRAKE, CUBIC, LAG = 35.0, 0.004, 0.01, 0.02, 0.1, 0.012
EFFECTS = {
    "input_shaft_mode": FREQUENCY,
    "tyre_slip": SLIP,
    "input_drag": DRAG,
    "brake_drag": BRAKE,
    "progressive_shaft": CUBIC,
    "torque_lag": LAG,
}


class Equations:
    """Speeds of crankshaft, output, wheel and vehicle; twists of both shafts; lagging torque."""

    def __init__(self, nominal: Trajectory) -> None:
        self.full = float(np.max(np.abs(nominal.shaft_torque)))
        self.largest = float(np.max(np.abs(SCENARIO.compute_torque(np.linspace(0.0, 5.0, 5001)))))
        omega, self.half = 2.0 * np.pi * FREQUENCY, 0.5 * MODEL.J1
        self.stiffness, self.damping = self.half * omega**2, 0.12 * omega * self.half
        self.load = MODEL.load.constant

    def compute_shaft(self, output: float, wheel: float, twist: float) -> float:
        """Torque of the output shaft [N m]."""
        linear = MODEL.k_o * twist
        elastic = linear * (1.0 + CUBIC * ((linear / self.full) ** 2 - 0.5))
        return float(elastic + MODEL.c_o * (output - MODEL.i_f * wheel))

    def evaluate(self, t: float, x: FloatArray) -> FloatArray:
        """Rates of the state."""
        crank, output, wheel, vehicle, inlet, twist, torque = x
        asked = float(SCENARIO.compute_torque(np.array([t]))[0])
        engine = RATIO * output
        passed = self.stiffness * inlet + self.damping * (crank - engine)
        shaft = self.compute_shaft(output, wheel, twist)
        tyre = self.full * MODEL.i_f / SLIP * (wheel - vehicle) / vehicle
        inertia = MODEL.J_out + MODEL.eta * RATIO**2 * self.half
        drive = MODEL.eta * RATIO * (passed - DRAG * self.largest)
        braked = MODEL.i_f * shaft - BRAKE * self.load - tyre
        return np.array(
            [
                (torque - passed) / self.half,
                (drive - shaft) / inertia,
                braked / (0.02 * MODEL.J_v),
                (tyre - self.load) / (0.98 * MODEL.J_v),
                crank - engine,
                output - MODEL.i_f * wheel,
                (asked - torque) / LAG,
            ]
        )

    def solve_steady(self) -> FloatArray:
        """State at time 0 from the balance of torques at one common acceleration."""
        engine = SCENARIO.engine_speed
        torque = float(SCENARIO.compute_torque(np.zeros(1))[0])
        drive = MODEL.eta * RATIO * (torque - DRAG * self.largest)
        against = (1.0 + BRAKE) * self.load / MODEL.i_f
        inertia = MODEL.J_out + MODEL.eta * MODEL.J1 * RATIO**2 + MODEL.J_v / MODEL.i_f**2
        rate = (drive - against) / inertia
        shaft = against + MODEL.J_v / MODEL.i_f**2 * rate
        share = np.roots([CUBIC, 0.0, 1.0 - 0.5 * CUBIC, -shaft / self.full])
        twist = float(share[np.abs(share.imag) < 1e-9].real[0]) * self.full / MODEL.k_o
        inlet = (torque - self.half * RATIO * rate) / self.stiffness
        wheel = engine / RATIO / MODEL.i_f
        tyre = self.load + 0.98 * MODEL.J_v * rate / MODEL.i_f
        vehicle = wheel / (1.0 + SLIP * tyre / (self.full * MODEL.i_f))
        return np.array([engine, engine / RATIO, wheel, vehicle, inlet, twist, torque])


@pytest.fixture(scope="module")
def equations() -> Equations:
    return Equations(run(SCENARIO, noise=0.0).trajectory)


def test_the_network_follows_the_equations(equations: Equations) -> None:
    motion = run(SCENARIO, noise=0.0, effects=EFFECTS).trajectory
    time = motion.time[motion.time <= END]
    start = equations.solve_steady()
    solved = solve_ivp(
        equations.evaluate,
        (0.0, END),
        start,
        method="LSODA",
        t_eval=time,
        rtol=1e-9,
        atol=1e-9,
        max_step=1e-3,
    )
    _, output, wheel, _, _, twist, _ = solved.y
    early = slice(0, time.size)
    shaft = np.array(
        [equations.compute_shaft(*each) for each in zip(output, wheel, twist, strict=True)]
    )
    # The table of the progressive shaft departs from its cubic by up to 1e-3 · 0.1 · FS.
    assert np.max(np.abs(motion.shaft_torque[early] - shaft)) < 2e-4 * equations.full
    assert np.max(np.abs(motion.output_speed[early] - output)) < 2e-3
    assert np.max(np.abs(motion.wheel_speed[early] - wheel)) < 1e-4
