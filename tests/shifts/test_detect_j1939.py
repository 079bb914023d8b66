# SPDX-License-Identifier: MIT
"""Real bus logs of a truck: every event within the figures read from them."""

from __future__ import annotations

from functools import cache

import pytest

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.findings import Code
from drivetwin.logs.read import read_log
from drivetwin.shifts.detect import detect_shifts
from drivetwin.shifts.lockup_clutch import detect_lock_ups
from drivetwin.vehicle.card import VehicleCard, load_card
from drivetwin.vehicle.spec import ShiftKind
from tests.shifts.fixtures import ROOT, shared

EVENTS = {
    "normal": (1.23, [("2", "3", 5.40, 5.76), ("3", "4", 9.60, 10.00)]),
    "address_claim": (3.83, [("2", "3", 8.06, 8.48)]),
}
"""Lock-up of the converter, then gears and inertia phase of each shift [s], read to 10 ms."""


@cache
def recording(name: str) -> tuple[ShiftLog, VehicleCard]:
    pytest.importorskip("cantools")
    card = load_card(ROOT / "examples" / "vehicles" / "j1939_class6.toml")
    return read_log(shared(f"j1939/trucksentry_{name}.log"), card), card


@pytest.mark.parametrize("name", EVENTS)
def test_shifts_and_phases(name: str) -> None:
    found = detect_shifts(*recording(name))
    expected = EVENTS[name][1]
    assert found.rejected == ()
    assert [(s.start_gear, s.end_gear) for s in found.shifts] == [e[:2] for e in expected]
    for shift, (_, _, start, end) in zip(found.shifts, expected, strict=True):
        assert shift.kind is ShiftKind.POWER_ON_UP
        assert shift.inertia_phase == pytest.approx((start, end), abs=0.05)
        assert abs(shift.quality["slip_at_lockup"]) < 1.0
        assert 0.0 < shift.sigma["inertia_start"] < 0.05
        assert 0.0 < shift.sigma["lockup"] < 0.05
        # The flag leads by 0.6 s; fill and torque phase share that time.
        assert 0.1 < shift.torque_phase[1] - shift.torque_phase[0] < 0.6
        assert Code.GEAR_SIGNAL_DIFFERS not in [one.code for one in shift.findings]


@pytest.mark.parametrize("name", EVENTS)
def test_lock_up_of_the_converter(name: str) -> None:
    (found,) = detect_lock_ups(*recording(name))
    assert found.time == pytest.approx(EVENTS[name][0], abs=0.05)
    assert found.warning == ""
