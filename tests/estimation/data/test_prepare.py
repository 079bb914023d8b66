# SPDX-License-Identifier: MIT
"""From a drive to what the estimators see of one shift: what is near it, and the fitted shifts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.estimation.data import prepare as preparation
from drivetwin.estimation.data.prepare import (
    collect_tolerances,
    prepare,
    prepare_shift,
)
from drivetwin.estimation.data.select_shifts import drop_unbalanced
from drivetwin.estimation.data.shift_data import PreparedLog, ShiftSignals
from drivetwin.estimation.linear.estimates import apply_sensor_error
from drivetwin.shifts.detect import FoundShifts
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.shift_kind import ShiftKind
from drivetwin.vehicle.spec import PriorValue, SensorTolerance
from drivetwin.vehicle.vehicle_card import VehicleCard
from tests.shifts.fixtures import make_card

CARD = make_card({"2": 1.91, "3": 1.43})
KINDS = {
    "engine_torque": Quantity.TORQUE,
    "output_torque": Quantity.TORQUE,
    "input_speed": Quantity.SPEED,
    "output_speed": Quantity.SPEED,
    "wheel_speed": Quantity.SPEED,
    "pressure.B2": Quantity.PRESSURE,
    "pressure.B3": Quantity.PRESSURE,
}


def shift(start: float) -> Shift:
    """A shift of 0.6 s between gears held for a minute and half a minute."""
    middle, lockup = start + 0.2, start + 0.6
    return Shift(
        "2", "3", "B2", "B3", ShiftKind.POWER_ON_UP,
        before=(start - 60.0, start), torque_phase=(start, middle), inertia_phase=(middle, lockup),
        after=(lockup, lockup + 30.0), lockup_time=lockup,
    )  # fmt: skip


def drive() -> ShiftLog:
    """200 s of channels that are noise about 100."""
    rng = np.random.default_rng(0)
    time = np.arange(0.0, 200.0, 0.01)
    channels = {
        role: Channel(role, kind, time, 100.0 + rng.normal(0.0, 1.0, time.size), role, "")
        for role, kind in KINDS.items()
    }
    return ShiftLog(channels, "made", "")


def signals_of(log: ShiftLog, one: Shift) -> ShiftSignals:
    return prepare_shift(log, CARD, one).signals


def test_the_tolerance_of_the_speed_sensor_that_is_read_is_one_of_the_engine_speed() -> None:
    sensors = {
        "input_speed": SensorTolerance(1e-3, 0.5),
        "engine_speed": SensorTolerance(2e-3, 0.1),
        "output_torque": SensorTolerance(0.01, 30.0),
    }
    log, card = drive(), replace(CARD, i_in=PriorValue(1.2), sensors=sensors)
    other = {"output_torque": sensors["output_torque"]}
    found = collect_tolerances(log, card, shift(100.0))
    assert found == {**other, "engine_speed": SensorTolerance(1e-3, 0.6)}
    # What such an error does to the log is what it does to the signals.
    wrong = replace(log["input_speed"], values=1.001 * log["input_speed"].values + 0.5)
    changed = replace(log, channels={**log.channels, "input_speed": wrong})
    there = prepare_shift(changed, card, shift(100.0)).signals
    right = prepare_shift(log, card, shift(100.0)).signals
    here = apply_sensor_error(right, "engine_speed", SensorTolerance(1e-3, 0.6))
    assert here.engine_speed.values == pytest.approx(there.engine_speed.values)
    engine = replace(
        log["input_speed"], role="engine_speed", values=1.2 * log["input_speed"].values
    )
    both = replace(log, channels={**log.channels, "engine_speed": engine})
    assert collect_tolerances(both, card, shift(100.0)) == {
        **other,
        "engine_speed": sensors["engine_speed"],
    }


def test_rows_that_show_values_late_make_ages_uncertain() -> None:
    log = drive()
    late = {role: replace(one, late=0.01) for role, one in log.channels.items()}
    card = replace(CARD, sensors={"output_torque": SensorTolerance(0.01, 30.0, 4e-3)})
    found = collect_tolerances(replace(log, channels=late), card, shift(100.0))
    spread = 0.01 / float(np.sqrt(12.0))
    assert found["output_torque"] == SensorTolerance(0.01, 30.0, float(np.hypot(4e-3, spread)))
    assert found["engine_speed"] == found["pressure.B2"] == SensorTolerance(delay=spread)
    assert "input_speed" not in found
    assert collect_tolerances(log, card, shift(100.0)) == card.sensors


def test_what_is_older_has_the_values_of_before() -> None:
    signals = signals_of(drive(), shift(100.0))
    older = apply_sensor_error(signals, "output_torque", SensorTolerance(delay=2e-3)).output_torque
    assert older.time == pytest.approx(signals.output_torque.time + 2e-3)
    assert older.values == pytest.approx(signals.output_torque.values)


def _prepare(log: ShiftLog, card: VehicleCard) -> PreparedLog:
    return prepare(log, card, FoundShifts((shift(80.0), shift(150.0)), ()))


def test_a_shift_in_overrun_does_not_stop_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    log = drive()
    torque = log["output_torque"]
    coasting = np.where(torque.time < 115.0, -100.0, 100.0) + (torque.values - 100.0)
    changed = {**log.channels, "output_torque": replace(torque, values=coasting)}
    monkeypatch.setattr(
        preparation, "select_shifts", lambda _all, _i_f, shifts: (tuple(shifts), ())
    )
    card = replace(CARD, loss_law="dissipative")
    (one,) = drop_unbalanced(_prepare(replace(log, channels=changed), card)).signals
    assert one.shift.before[1] == 150.0
