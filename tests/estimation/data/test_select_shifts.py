# SPDX-License-Identifier: MIT
"""Which shifts of a drive are fitted: those with one load, and no more than tell something new."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel
from drivetwin.estimation.data.select_shifts import select_shifts
from drivetwin.likelihood.measured_signal import prepare_signal
from drivetwin.shifts.shift import RejectedShift, Shift
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.spec import ShiftKind
from tests.shifts.fixtures import make_card
from tests.support.arrays import FloatArray

CARD: VehicleCard = make_card({"2": 1.91, "3": 1.43})
J_VEHICLE = 6000.0
MOST = 12
"""Shifts that are fitted, at most."""
BRAKED = (40.0, 46.0)


def shift(lockup: float, kind: ShiftKind = ShiftKind.POWER_ON_UP) -> Shift:
    """A shift with 4 s of gear before and after."""
    start, middle = lockup - 0.6, lockup - 0.4
    return Shift(
        "2", "3", "B2", "B3", kind,
        before=(start - 4.0, start), torque_phase=(start, middle), inertia_phase=(middle, lockup),
        after=(lockup, lockup + 4.0), lockup_time=lockup,
    )  # fmt: skip


def drive(braked: tuple[float, float] = BRAKED) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Time, output torque and wheel speed (n,) of 200 s; a brake comes on in the span `braked`."""
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 200.0, 0.01)
    torque = 800.0 + 400.0 * np.sin(1.3 * time)
    brake = np.interp(time, [braked[0], sum(braked) / 2.0, braked[1]], [0.0, 3000.0, 0.0])
    wheel = 20.0 + np.cumsum(CARD.final_drive.value * (torque - 800.0 - brake)) * 0.01 / J_VEHICLE
    noisy = torque + rng.normal(0.0, 20.0, time.size), wheel + rng.normal(0.0, 0.03, time.size)
    return time, *noisy


def channels(torque: FloatArray | None = None, wheel: FloatArray | None = None) -> tuple[Any, Any]:
    """Output torque and wheel speed of the `drive`, or others at its times."""
    time, *braked = drive()
    values = (
        braked[0] if torque is None else torque,
        braked[1] if wheel is None else wheel,
    )
    roles = ("output_torque", Quantity.TORQUE), ("wheel_speed", Quantity.SPEED)
    torque_, wheel_ = (
        prepare_signal(Channel(role, quantity, time, column, role, ""))
        for (role, quantity), column in zip(roles, values, strict=True)
    )
    return torque_, wheel_


def choose(
    given: tuple[Any, Any] | None, shifts: Sequence[Shift]
) -> tuple[tuple[Shift, ...], tuple[RejectedShift, ...]]:
    return select_shifts(given, CARD.final_drive.value, shifts)


def test_a_brake_that_looks_like_inertia_is_seen_against_the_other_shifts() -> None:
    """It follows the acceleration: by itself such a shift tells another J3, and no more."""
    time, torque, wheel = drive((0.0, 0.1))
    span = (time > 38.0) & (time < 48.0)
    torque = torque.copy()
    torque[span] += 0.3 * (torque[span] - 800.0)
    spans = [shift(20.0), shift(43.0), shift(60.0), shift(75.0)]
    kept, refused = choose(channels(torque, wheel), spans)
    assert kept == (spans[0], *spans[2:])
    assert "load is not constant" in refused[0].reason


def test_a_braked_shift_is_left_out_where_others_do_without() -> None:
    kept, refused = choose(channels(), (shift(20.0), shift(43.0), shift(60.0)))
    assert kept == (shift(20.0), shift(60.0))
    (one,) = refused
    assert one.time[0] == pytest.approx(42.4)
    assert "load is not constant" in one.reason


def test_what_is_alone_or_alike_stays() -> None:
    assert choose(channels(), (shift(43.0),)) == ((shift(43.0),), ())
    both = (shift(43.0), shift(43.5))
    assert choose(channels(), both) == (both, ())


def test_a_shift_that_tells_nothing_of_its_load_is_left_out() -> None:
    brief = replace(shift(80.0), before=(79.95, 79.96), after=(80.0, 80.2))
    kept, (one,) = choose(channels(), (shift(20.0), brief))
    assert kept == (shift(20.0),)
    assert "do not determine its load" in one.reason


def test_no_more_shifts_than_tell_something_new() -> None:
    usual = [shift(50.0 + 5.0 * k) for k in range(MOST + 5)]
    rare = replace(shift(150.0), kind=ShiftKind.POWER_OFF_UP)
    kept, refused = choose(channels(), (*usual, rare))
    assert len(kept) == MOST
    assert rare in kept
    assert list(kept) == sorted(kept, key=lambda one: one.lockup_time)
    assert len(refused) == len(usual) + 1 - MOST
    assert all("not needed" in one.reason for one in refused)
