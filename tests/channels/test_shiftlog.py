# SPDX-License-Identifier: MIT
"""A log in memory: what none can be made of, and the units of what it holds."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.errors import TimeError


@pytest.mark.parametrize("start", [1763866345.0, -1e9, 1e6 - 0.5])
def test_a_log_whose_time_is_too_far_from_zero_is_refused(start: float) -> None:
    time = np.linspace(start, start + 0.99, 100)
    channel = Channel("input_speed", Quantity.SPEED, time, np.ones(100), "SpdIn", "rad/s")
    with pytest.raises(TimeError, match="let time count from the start of the log") as fault:
        ShiftLog({"input_speed": channel}, "a.csv", "")
    assert fault.value.where.channel == "SpdIn"
