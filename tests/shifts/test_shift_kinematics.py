# SPDX-License-Identifier: MIT
"""One clutch that serves both gears is split where it is open; two elements stay as they are."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.shifts.shift import Shift, get_shift_pressures
from drivetwin.vehicle.spec import ShiftKind

TIME = np.linspace(0.0, 4.0, 401)
PRESSURE = np.interp(TIME, [1.9, 2.1, 2.5, 2.8], [1e6, 0.0, 0.0, 8e5])
SHIFT = Shift(
    "2", "3", "K2", "K3", ShiftKind.POWER_ON_UP, (0.0, 2.0), (2.0, 2.0), (2.0, 2.7), (2.7, 4.0), 2.7
)


def _log(**columns: tuple[str, object]) -> ShiftLog:
    channels = {}
    for element, (column, values) in columns.items():
        role = f"pressure.{element}"
        channel = Channel(role, Quantity.PRESSURE, TIME, np.asarray(values), column, "Pa")
        channels[role] = channel
    return ShiftLog(channels, "made", "")


def test_one_column_belongs_to_each_element_in_turn() -> None:
    log = _log(K2=("P", PRESSURE), K3=("P", PRESSURE))
    parts = get_shift_pressures(log, SHIFT)
    assert parts["K2"].values + parts["K3"].values == pytest.approx(PRESSURE)
    assert parts["K2"].values[TIME > 2.4].max() == 0.0
    assert parts["K3"].values[TIME < 2.2].max() == 0.0
    assert parts["K3"].role == "pressure.K3"
