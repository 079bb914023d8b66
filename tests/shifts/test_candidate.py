# SPDX-License-Identifier: MIT
"""Runs of gears held, from speed ratios alone."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from drivetwin.shifts.candidate import Run, detect_gear_runs
from drivetwin.shifts.kinematics import GearboxSpeeds
from drivetwin.shifts.shift import ShiftSettings

_RATIOS = {"2": 1.9, "3": 1.4, "4": 1.0}
_TIME = np.arange(0.0, 2.0, 1e-3)


def _runs(ratio: NDArray[np.float64], output: NDArray[np.float64] | None = None) -> list[Run]:
    speed = np.full_like(_TIME, 80.0) if output is None else output
    speeds = GearboxSpeeds(_TIME, ratio * speed, speed)
    return detect_gear_runs(speeds, _RATIOS, ShiftSettings())


def _gears(runs: list[Run]) -> list[str | None]:
    return [run.gear for run in runs]


def test_gear_passed_through_is_not_held() -> None:
    assert _gears(_runs(np.interp(_TIME, [0.5, 1.5], [1.9, 1.0]))) == ["2", None, "4"]


def test_short_disturbance_does_not_end_a_gear() -> None:
    ratio = np.full_like(_TIME, 1.4)
    ratio[1000:1030] = 1.6
    assert _runs(ratio) == [Run("3", 0, len(_TIME) - 1)]
    ratio[1000:1100] = 1.6
    assert _gears(_runs(ratio)) == ["3", None, "3"]


def test_standstill_belongs_to_no_run() -> None:
    output = np.where(_TIME < 1.0, 0.0, 80.0)
    runs = _runs(np.full_like(_TIME, 1.4), output)
    assert _gears(runs) == ["3"]
    assert abs(runs[0].first - 1000) <= 2


def test_close_gears_keep_apart_in_noise() -> None:
    """Gears 4 % apart under noise whose spread alone would make the tolerance reach over."""
    rng = np.random.default_rng(3)
    ratio = np.where(_TIME < 1.0, 1.04, 1.0) * (1.0 + 2e-3 * rng.normal(size=len(_TIME)))
    speeds = GearboxSpeeds(_TIME, 80.0 * ratio, np.full_like(_TIME, 80.0))
    runs = detect_gear_runs(speeds, {"a": 1.04, "b": 1.0}, ShiftSettings())
    assert [run.gear for run in runs if run.gear] == ["a", "b"]
