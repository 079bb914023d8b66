# SPDX-License-Identifier: MIT
"""Jumps of a speed after lost messages, of numbers that overflow, and stamps that repeat."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.channels.roles import get_quantity
from drivetwin.channels.shiftlog import Channel
from drivetwin.errors import DamagedChannelError, TimeError
from drivetwin.findings import Code
from drivetwin.logs.quality.channel_checks import check_channel
from tests.support.arrays import FloatArray

RPM = np.pi / 30.0


def channel(role: str, time: FloatArray, values: FloatArray) -> Channel:
    return Channel(role, get_quantity(role), time, values, "X", "rpm")


def rows_of_messages(count: int = 400) -> tuple[FloatArray, FloatArray]:
    """Stamps of two messages every 20 ms, 2 ms apart; speed [rad/s] of the second, held."""
    sent = np.arange(count) * 0.02
    time = np.sort(np.concatenate((sent, sent + 0.002)))
    speed = RPM * np.interp(sent, [3.0, 3.5], [2600.0, 1300.0])
    speed += 0.05 * np.sin(17.0 * sent)
    return np.round(time, 3), np.concatenate((speed[:1], np.repeat(speed, 2)[:-1]))


@given(
    lost=st.integers(9, 12),
    first=st.integers(151, 162),
    role=st.sampled_from(["input_speed", "engine_speed"]),
)
def test_a_burst_of_lost_messages_is_left_out(lost: int, first: int, role: str) -> None:
    time, speed = rows_of_messages()
    start, end = 2 * first + 1, 2 * (first + lost) + 1
    speed[start:end] = speed[start - 1]
    checked = check_channel(channel(role, time, speed), "log.csv")
    left = np.isin(time, checked.channel.time)
    assert not left[start:end].any()
    assert left[: start - 2].all()
    assert left[end:].all()
    told = {one.code for one in checked.findings} - {Code.NO_SAMPLES}
    assert told <= {Code.MESSAGES_LOST, Code.STUCK}
    assert told


def test_a_slow_message_in_a_fast_table_is_no_burst() -> None:
    time = np.round(np.arange(4000) * 0.001, 3)
    sent = 150.0 + 60.0 * np.sin(np.arange(100) * 0.9)
    checked = check_channel(channel("input_speed", time, np.repeat(sent, 40)), "log.csv")
    assert checked.channel.time.size == 4000
    assert checked.findings == ()


@pytest.mark.parametrize("size", [102.4, -102.4])
def test_a_number_that_overflows_is_refused(size: float) -> None:
    time = np.round(np.arange(400) * 0.01, 2)
    speed = np.linspace(150.0, 170.0, 400)
    speed[200:] += size
    with pytest.raises(DamagedChannelError, match=r"jumps from .* \(1 such jumps\)") as caught:
        check_channel(channel("input_speed", time, speed), "log.csv")
    assert caught.value.where.time == 2.0


@pytest.mark.parametrize("places", [[500], [0], [1998], [100, 1700]])
def test_few_repeated_stamps_are_left_out(places: list[int]) -> None:
    time = np.round(np.arange(2000) * 0.01, 2)
    time[np.array(places) + 1] = time[places]
    speed = np.linspace(100.0, 150.0, 2000)
    checked = check_channel(channel("input_speed", time, speed), "log.csv")
    assert checked.channel.time.tolist() == np.unique(time).tolist()
    (found,) = [one for one in checked.findings if one.code is not Code.NO_SAMPLES]
    assert found.code is Code.STAMPS_REPEATED
    assert found.numbers["samples"].value == len(places)


def test_many_repeated_stamps_are_refused() -> None:
    time = np.round(np.arange(2000) * 0.01, 2)
    time[101:2000:300] = time[100:1999:300]
    with pytest.raises(TimeError, match="repeats the stamp before it"):
        check_channel(channel("input_speed", time, np.linspace(100.0, 150.0, 2000)), "log.csv")
