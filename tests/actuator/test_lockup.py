# SPDX-License-Identifier: MIT
"""Slip of a lock-up clutch against closed forms."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.actuator.held_signal import HeldSignal
from drivetwin.actuator.lockup import LockupClutch, SlipRecord, identify_lockup, simulate_slip
from drivetwin.actuator.model import ActuatorModel
from drivetwin.errors import IdentificationError

CLUTCH = LockupClutch(
    ActuatorModel(0.05, 0.005, 0.005, kiss_pressure=7e4), 3e-3, 1.25, inertia=0.25, fluid=2.0
)
TIME = np.arange(0.0, 1.0, 0.02)


def make_record(first: float, then: float) -> SlipRecord:
    command = HeldSignal(np.array([0.0, 0.2]), np.array([first, then]))
    return SlipRecord(command, TIME, np.full(TIME.size, 100.0), np.zeros(TIME.size), 0.5)


def test_a_clutch_above_its_static_capacity_holds() -> None:
    assert not simulate_slip(CLUTCH, make_record(1.2e5, 1.0e5)).any()


def test_a_released_clutch_slips_by_the_fluid_and_the_inertia() -> None:
    slip = simulate_slip(CLUTCH, make_record(1.2e5, 0.0))
    assert not slip[TIME < 0.25].any()
    left = 50.0 - slip[TIME > 0.35]  # from the final slip T_e/b, with the time constant J/b
    rates = -np.diff(np.log(left[:10])) / 0.02
    assert rates == pytest.approx(np.full(9, 8.0), rel=0.02)
    begin = 0.36 + np.log(left[0] / 50.0) / 8.0
    assert 0.25 < begin < 0.27  # the dead time after the command, and the lag


def test_a_clutch_that_is_closed_again_stops_slipping() -> None:
    record = make_record(0.0, 2.0e5)
    open_ = replace(record, command=HeldSignal(np.array([0.0, 0.4]), np.array([0.0, 2.0e5])))
    slip = simulate_slip(CLUTCH, open_)
    assert slip[TIME < 0.4].max() > 20.0
    assert slip[-1] == 0.0


def test_a_record_without_slip_is_refused() -> None:
    with pytest.raises(IdentificationError, match="does not slip"):
        identify_lockup([make_record(1.2e5, 1.2e5)])
