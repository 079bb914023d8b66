# SPDX-License-Identifier: MIT
"""Kinds of shift and the pressures that make them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.drive.schedule import Schedule
from drivetwin.drive.shift_plan import FILL, RAMP, ShiftPlan, compute_pressure
from drivetwin.gearbox import Gearbox, reduce
from drivetwin.vehicle.shift_kind import ShiftKind


@pytest.fixture
def upshift(gearbox: Gearbox) -> ShiftPlan:
    return ShiftPlan(
        reduction=reduce(gearbox, "2", "3"),
        drive=gearbox.require_drive(),
        start=1.0,
        held=1500.0,
        torque=1600.0,
        swing=-45.0,
        slip=107.0,
        inertia=20.0,
        main=2e6,
    )


def schedule() -> Schedule:
    return Schedule({"C4": ((0.0, 2e6),), "C3": ((0.0, 0.0),)})


def value(found: Schedule, name: str, time: float) -> float:
    return float(found.evaluate(name, np.array([time]))[0])


def test_pressure_inverts_the_capacity(gearbox: Gearbox) -> None:
    capacity = gearbox.get_capacity("C3")
    slip = np.array([30.0])
    level = compute_pressure(capacity, 1250.0, 30.0)
    mu = float(capacity.friction.evaluate(slip)[0])
    assert mu * capacity.gain * (level - capacity.P0) == pytest.approx(1250.0)


def test_torque_is_handed_over_before_the_input_slows_down(upshift: ShiftPlan) -> None:
    """At the end of the torque phase C3 holds i_c·T and C4 nothing; 0.43·1500 N m are 645 N m."""
    found = upshift.add_opening(schedule())
    release = upshift.filled + upshift.drive.torque_phase
    on, off = (upshift.reduction.gearbox.get_capacity(name) for name in ("C3", "C4"))
    mu = float(on.friction.evaluate(np.array([107.0]))[0])
    assert value(found, "C3", upshift.filled) == pytest.approx(on.P0)
    handed = mu * on.gain * (value(found, "C3", release) - on.P0)
    assert handed == pytest.approx(upshift.reduction.on_coming.i_c * 1500.0)
    assert handed == pytest.approx(645.0, rel=0.01)
    assert value(found, "C4", release) == pytest.approx(off.P0)
    assert value(found, "C3", release + RAMP) > value(found, "C3", release)


def test_kick_down_keeps_torque_on_the_off_going_element(upshift: ShiftPlan) -> None:
    kick = replace(upshift, swing=20.0)
    found = kick.add_opening(schedule())
    assert kick.kind is ShiftKind.POWER_ON_DOWN
    off = kick.reduction.gearbox.get_capacity("C4")
    mu = float(off.friction.evaluate(np.zeros(1))[0])
    left = 1600.0 - 20.0 * 20.0 / kick.drive.inertia_phase
    kept = mu * off.gain * (value(found, "C4", kick.start + FILL + RAMP) - off.P0)
    assert kept == pytest.approx(kick.reduction.off_going.i_c * left)
    assert value(found, "C3", kick.start + FILL + RAMP) == pytest.approx(off.P0)


def test_synchronism_closes_one_and_opens_the_other(upshift: ShiftPlan) -> None:
    found = upshift.close(upshift.add_opening(schedule()), 1.7)
    assert found.get_last_value("C3") == upshift.main
    assert found.get_last_value("C4") == 0.0
