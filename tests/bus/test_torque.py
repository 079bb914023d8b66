# SPDX-License-Identifier: MIT
"""Balance of torque in gear: inertia and dead time of two inertias on a shaft, by SciPy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import lsim

from drivetwin.bus.drift import Swing
from drivetwin.bus.recording import Signal
from drivetwin.bus.road_load import RoadLoad, combine_loads, estimate_loads
from drivetwin.bus.torque import (
    TorqueSpan,
    balance_held,
    select_held,
)
from drivetwin.estimation.result.estimate import Z95
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


J, RATIO, ZERO, NOISE = 120.0, 2.0, 12.0, 0.01
LOADS = (250.0, 300.0, 380.0, 270.0, 420.0, 330.0)


def make_span(number: int, load: float) -> TorqueSpan:
    """A gear held for 4 s; the message has the torque with a zero error."""
    rng = np.random.default_rng(number)
    stamps = np.arange(-0.5, 4.5, 0.02)
    knots = np.arange(-0.5, 5.0, 0.5)
    acting = Signal("", stamps, np.interp(stamps, knots, rng.uniform(50.0, 500.0, knots.size)), 0.0)
    time = np.arange(0.0, 4.0, 0.02)
    fine = np.arange(0.0, 4.0, 1e-4)
    integrated = np.interp(time, fine, 1e-4 * np.cumsum(np.interp(fine, stamps, acting.values)))
    speed = 60.0 + (RATIO * integrated - load * time) / J
    shown = Signal("", stamps, acting.values + ZERO, 0.0)
    noisy = speed + rng.normal(0.0, NOISE, time.size)
    return TorqueSpan(f"span {number}", "2", time, noisy, 1e-4, shown, RATIO, Swing(1.5, 20.0))


@pytest.fixture(scope="module")
def spans() -> list[TorqueSpan]:
    return [make_span(number, load) for number, load in enumerate(LOADS)]


def test_each_span_has_its_load_but_for_the_zero_error(spans: list[TorqueSpan]) -> None:
    """Without an open clutch nothing shows the zero error; the interval holds it."""
    balance = balance_held(spans, 0.0)
    assert balance is not None
    loads = estimate_loads({"2": spans}, {"2": balance}, None)
    assert [one.label for one in loads] == [one.label for one in spans]
    assert loads[0].speed == pytest.approx(spans[0].speed.mean())
    for one, true in zip(loads, LOADS, strict=True):
        assert one.torque - true == pytest.approx(RATIO * ZERO, abs=12.0)
        assert abs(one.torque - true) < Z95 * 2.0 * one.std
    assert estimate_loads({"2": spans}, {}, None) == ()
    assert combine_loads(()) is None


def test_the_mean_holds_scatter_and_common_errors() -> None:
    loads = [RoadLoad(f"{k}", "2", 50.0, 300.0 + d, 1.0, 0.0, 0.0, 20.0) for k, d in
             enumerate((-30.0, -10.0, 10.0, 30.0))]  # fmt: skip
    found = combine_loads(loads)
    assert found is not None
    mean, std, combined = found
    assert mean == pytest.approx(300.0, abs=0.5)
    assert combined.tau[0] == pytest.approx(np.std([-30.0, -10.0, 10.0, 30.0], ddof=1), rel=0.1)
    assert std == pytest.approx(float(np.hypot(combined.std[0], 20.0)))
