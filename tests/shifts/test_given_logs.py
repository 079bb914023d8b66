# SPDX-License-Identifier: MIT
"""Shift detection on data of another program: true events, and measured logs."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.spec import PriorValue, ShiftKind
from tests.shifts.fixtures import load_measured, load_reference, make_card

_CASES = ("upshift", "drum_inertia", "weak_then_catch")


def _card(second: float, third: float, P0: PriorValue) -> VehicleCard:
    return make_card({"2": second, "3": third}, P0)


@pytest.mark.parametrize("name", _CASES)
def test_noise_free_events(name: str) -> None:
    truth = load_reference(name)
    (shift,), rejected = detect_shifts(truth.log, _card(1.91, 1.43, PriorValue(0.8e5)))
    assert rejected == ()
    assert shift.lockup_time == pytest.approx(truth.lock_up, abs=5e-4)
    assert shift.inertia_phase[0] == pytest.approx(truth.break_away, abs=2e-3)
    # The on-coming pressure of these cases passes P0 at 0.21 s.
    assert shift.torque_phase[0] == pytest.approx(0.21, abs=1e-3)


@pytest.mark.parametrize("name", _CASES)
def test_lock_up_with_noise(name: str) -> None:
    """Noise of 0.3 rad/s on the input and 0.05 on the output speed: 2 ms, and sigma covers."""
    errors, scores = [], []
    for seed in range(8):
        truth = load_reference(name, noise=(0.3, 0.05), seed=seed)
        (shift,), _ = detect_shifts(truth.log, _card(1.91, 1.43, PriorValue(0.8e5)))
        errors.append(shift.lockup_time - truth.lock_up)
        scores.append(errors[-1] / shift.sigma["lockup"])
    assert np.median(np.abs(errors)) < 2e-3
    assert np.abs(scores).max() < 3.0


@pytest.mark.parametrize("name", ["truck_a", "paper_like"])
def test_measured_logs(name: str) -> None:
    log, card = load_measured(name)
    (shift,), rejected = detect_shifts(log, card)
    assert rejected == ()
    assert shift.kind is ShiftKind.POWER_ON_UP
    assert 0.05 < shift.torque_phase[1] - shift.torque_phase[0] < 0.3
    assert 0.2 < shift.inertia_phase[1] - shift.inertia_phase[0] < 0.5
    assert shift.sigma["lockup"] < 1e-3
    assert shift.sigma["inertia_start"] < 5e-3
    # The output torque has its hole before break-away and rises after it.
    torque = log["output_torque"]
    at = [
        float(torque.interpolate(np.array([t]))[0])
        for t in (shift.before[1], *shift.torque_phase[1:])
    ]
    assert at[1] < at[0]
    assert shift.quality["torque_hole_depth"] > 0.2 * at[0]
    assert shift.findings == ()
