# SPDX-License-Identifier: MIT
"""One identification finds the updates of a channel once and refers a shift to the turbine once."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray

from drivetwin.channels import shiftlog
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.channels.update_raster import find_updates
from drivetwin.estimation.data import prepare
from drivetwin.estimation.result.method import Method
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.shifts.lockup_clutch import refer_to_turbine
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.vehicle_card import VehicleCard
from tests.estimation.asked import record_log
from tests.support.arrays import FloatArray

REPEATS = 2
"""Rows of the table in which each value is repeated."""


def hold(channel: Channel) -> Channel:
    """A channel in a table that repeats each of its values."""
    ends = np.append(channel.time, 2.0 * channel.time[-1] - channel.time[-2])
    between = [np.linspace(*pair, REPEATS, endpoint=False) for pair in pairwise(ends)]
    time: FloatArray = np.concatenate(between)
    return replace(channel, time=time, values=np.repeat(channel.values, REPEATS), held=True)


@pytest.mark.parametrize("method", list(Method))
def test_each_channel_and_each_shift_is_prepared_once(
    method: Method, monkeypatch: pytest.MonkeyPatch
) -> None:
    log, card = record_log("paper")
    log = replace(log, channels={role: hold(one) for role, one in log.channels.items()})
    columns: list[FloatArray] = []
    referred: list[Shift] = []

    def count_updates(
        time: FloatArray, values: FloatArray
    ) -> tuple[FloatArray, NDArray[np.intp]] | None:
        columns.append(values)
        return find_updates(time, values)

    def count_referrals(log: ShiftLog, card: VehicleCard, shift: Shift) -> ShiftLog:
        referred.append(shift)
        return refer_to_turbine(log, card, shift)

    monkeypatch.setattr(shiftlog, "find_updates", count_updates)
    monkeypatch.setattr(prepare, "refer_to_turbine", count_referrals)
    found = detect_shifts(log, card)
    identify(log, card, found, method)
    assert len(columns) == len(log.channels) == len({id(one) for one in columns})
    assert len(referred) == len(found.shifts)
