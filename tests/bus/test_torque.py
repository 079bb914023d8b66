# SPDX-License-Identifier: MIT
"""Balance of torque in gear: inertia and dead time of two inertias on a shaft, by SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lsim

from drivetwin.bus.drift import Swing
from drivetwin.bus.recording import Signal
from drivetwin.bus.torque import balance_held, select_held
from tests.support.arrays import FloatArray

FRONT, VEHICLE, STIFFNESS, DAMPING = 20.0, 180.0, 18.0 * 4.0e2, 60.0
"""Inertias [kg m^2], stiffness [N m/rad] and damping [N m s/rad] of a shaft: 3.2 Hz."""
CORNERS = np.array(
    [[0.0, 100.0], [0.8, 100.0], [1.0, 900.0], [2.1, 700.0], [2.3, 150.0], [5.2, 400]]
)
"""Engine torque [N m] over time [s]."""


def simulate(time: FloatArray) -> FloatArray:
    """Return the speed (n,) [rad/s] of the front inertia."""
    A = np.array(
        [
            [-DAMPING / FRONT, DAMPING / FRONT, -1.0 / FRONT],
            [DAMPING / VEHICLE, -DAMPING / VEHICLE, 1.0 / VEHICLE],
            [STIFFNESS, -STIFFNESS, 0.0],
        ]
    )
    B, C = np.array([[1.0 / FRONT], [0.0], [0.0]]), np.array([[1.0, 0.0, 0.0]])
    torque = np.interp(time, *CORNERS.T)
    start = np.array([100.0, 100.0, 0.0])
    return np.asarray(lsim((A, B, C, np.zeros((1, 1))), torque, time, start)[1])


@pytest.mark.parametrize("dead", [0.0, 0.034])
def test_neighbours_that_are_averaged_change_no_inertia(dead: float) -> None:
    fine = np.arange(0.0, 5.2, 1e-3)
    time = np.arange(0.1, 5.1, 1e-2)
    inlet = Signal("in", time, np.interp(time, fine, simulate(fine)), 1e-5)
    messages = np.arange(0.0, 5.2, 5e-3)
    torque = Signal("torque", messages + dead, np.interp(messages, *CORNERS.T), 1e-3)
    series = FRONT * VEHICLE / (FRONT + VEHICLE)
    rate = 0.5 * DAMPING / series
    swing = Swing(rate, float(np.sqrt(STIFFNESS / series - rate**2)))
    spans = select_held("log", "3", (0.2, 5.0), inlet, 1.0, swing, torque)
    assert {one.width for one in spans} == {3}
    found = balance_held(spans)
    assert found is not None
    inertia, std = found.compute_inertia()
    assert inertia == pytest.approx(FRONT + VEHICLE, rel=5e-4)
    assert std < 2e-3 * inertia
    assert found.compute_dead_time()[0] == pytest.approx(dead, abs=2e-4)
