# SPDX-License-Identifier: MIT
"""Start of the torque phase from the on-coming pressure or the output torque."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.dyno import ScenarioName
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.shifts.breakaway_lockup import (
    locate_pressure_onset,
    locate_torque_dip,
    smooth_channel,
)
from drivetwin.shifts.detect import detect_shifts
from tests.support.bench import read_run

_TIME = np.arange(0.0, 1.0, 1e-3)
_SPAN = (0.0, 1.0)
_P0 = 0.8e5
_SLOPE = 40e5
"""Ramp of the on-coming pressure [Pa/s]."""


def _channel(values: NDArray[np.float64], noise: float = 0.0, seed: int = 0) -> Channel:
    values = values + noise * np.random.default_rng(seed).normal(size=len(values))
    return Channel("pressure.B3", Quantity.PRESSURE, _TIME, values, "p3", "Pa")


def _ramp(start: float) -> NDArray[np.float64]:
    """Vented, filled to half of P0 at 0.4 s, then a ramp that passes P0 at `start`."""
    return np.clip(_P0 + _SLOPE * (_TIME - start), np.where(_TIME > 0.4, 0.5 * _P0, 0.0), 8e5)


def test_crossing_within_sigma() -> None:
    scores = []
    for seed in range(30):
        onset = locate_pressure_onset(
            smooth_channel(_channel(_ramp(0.6), 8e3, seed), _SPAN), (_P0, 0.0), 0.8
        )
        assert onset is not None
        scores.append((onset.time - 0.6) / onset.sigma)
    assert np.abs(scores).max() < 4.0
    assert 0.3 < np.std(scores) < 1.5


def test_filling_pulse_is_no_onset() -> None:
    pulse = np.where(np.abs(_TIME - 0.3) < 0.03, 3e5, 0.0)
    onset = locate_pressure_onset(
        smooth_channel(_channel(_ramp(0.6) + pulse), _SPAN), (_P0, 0.0), 0.8
    )
    assert onset is not None
    assert onset.time == pytest.approx(0.6, abs=1e-3)


def test_torque_dip() -> None:
    dip = 2400.0 - 3e3 * np.clip(_TIME - 0.6, 0.0, None)
    onset = locate_torque_dip(smooth_channel(_channel(dip, noise=10.0), _SPAN), 0.8, 0.75)
    assert onset is not None
    assert abs(onset.time - 0.6) < 3.0 * onset.sigma
    assert onset.sigma < 0.02


def test_a_fall_of_the_engine_torque_before_is_not_taken_for_the_shift() -> None:
    driver = np.where(_TIME < 0.3, 3200.0, 2400.0)
    dip = driver - 3e3 * np.clip(_TIME - 0.6, 0.0, None)
    onset = locate_torque_dip(smooth_channel(_channel(dip, noise=10.0), _SPAN), 0.8, 0.75)
    assert onset is not None
    assert abs(onset.time - 0.6) < 3.0 * onset.sigma


@pytest.mark.parametrize(
    "name", [ScenarioName.PAPER_STEPS, ScenarioName.THROTTLE_STEPS, ScenarioName.GEARBOX_CHAIN]
)
def test_without_pressures_the_output_torque_tells_the_onset(
    name: ScenarioName,
) -> None:
    bench = run(load_scenario(name), seed=0)
    roles = ("engine_torque", "output_torque", "input_speed", "output_speed")
    channels = {one.role: one for one in bench.channels if one.role in roles}
    found = detect_shifts(ShiftLog(channels, "made", ""), read_run(bench)[1])
    assert len(found.shifts) == len(bench.truth.shifts)
    for shift, true in zip(found.shifts, bench.truth.shifts, strict=True):
        assert true.torque_start is not None
        late = shift.torque_phase[0] - true.torque_start
        assert abs(late) < min(3.0 * shift.sigma["torque_start"], 0.04)
