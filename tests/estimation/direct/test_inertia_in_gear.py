# SPDX-License-Identifier: MIT
"""Total inertia over η in a gear held: covered by its interval, refused where nothing shows it."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.estimation.direct.inertia_in_gear import HeldGear, estimate_gear_inertia
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.likelihood.measured_signal import MeasuredSignal
from tests.support.arrays import FloatArray
from tests.support.coverage import assert_covers, vary_draws

TRUE, LOAD, RATIO, ETA = 64.0, 90.0, 1.406, 0.9


def estimate_gear(
    seed: int, length: float = 20.0, swing: float = 250.0, grade: float = 15.0
) -> HeldGear:
    """Engine torque that wanders, a road whose grade wanders, an oscillation at 4.4 Hz, 20 ms."""
    rng = np.random.default_rng(seed)
    fine = np.arange(0.0, length, 1e-3)

    def wander(size: float, period: float) -> FloatArray:
        phases = rng.uniform(0.0, 2.0 * np.pi, 6)
        waves = [np.sin(2.0 * np.pi * fine / period * (1 + k) / 3 + phases[k]) for k in range(6)]
        return np.asarray(size * np.sum(waves, axis=0) / np.sqrt(3.0))

    torque = 150.0 + wander(swing, 12.0)
    rate = (ETA * RATIO * torque - LOAD - wander(grade, 9.0)) / TRUE
    speed = 120.0 + np.cumsum(rate) * 1e-3 + 0.8 * np.sin(2.0 * np.pi * 4.4 * fine)
    slow = slice(None, None, 20)
    noise = rng.normal(size=fine[slow].size)
    return estimate_gear_inertia(
        "3",
        RATIO,
        (0.0, length),
        MeasuredSignal(fine[slow], np.round(torque[slow] / 11.0) * 11.0),
        MeasuredSignal(fine[slow], speed[slow] + 0.05 * noise),
    )


@vary_draws()
def test_the_interval_covers_the_truth(draws: int) -> None:
    found = [estimate_gear(seed) for seed in range(draws)]
    assert all(one.verdict is not Verdict.NOT_IDENTIFIABLE for one in found)
    inside = sum(
        abs(one.value - TRUE / ETA) <= one.half
        for one in found
        if one.value is not None and one.half is not None
    )
    assert_covers(inside, draws)
    assert np.median([one.half / one.value for one in found if one.half and one.value]) < 0.2


def test_a_short_gear_and_a_steady_pedal_are_refused() -> None:
    for one in (estimate_gear(1, length=4.0), estimate_gear(2, swing=1.0, grade=40.0)):
        assert one.verdict is Verdict.NOT_IDENTIFIABLE
        assert one.value is None
        assert "ten seconds" in one.reason


def test_gaps_are_left_out() -> None:
    time = np.arange(0.0, 20.0, 0.02)
    torque = MeasuredSignal(time, 200.0 + 100.0 * np.sin(time))
    keep = np.arange(time.size) % 100 < 50
    one = estimate_gear_inertia(
        "3", RATIO, (0.0, 20.0), MeasuredSignal(time[keep], torque.values[keep]), torque
    )
    assert one.verdict is Verdict.NOT_IDENTIFIABLE
    assert one.reason.startswith("only 0.0 s")
    assert one.span == pytest.approx((0.0, 20.0))


def test_a_torque_that_stays_zero_tells_nothing() -> None:
    time = np.arange(0.0, 20.0, 0.02)
    still, speed = (
        MeasuredSignal(time, np.zeros_like(time)),
        MeasuredSignal(time, 100.0 + np.sin(time)),
    )
    one = estimate_gear_inertia("3", RATIO, (0.0, 20.0), still, speed)
    assert one.verdict is Verdict.NOT_IDENTIFIABLE
