# SPDX-License-Identifier: MIT
"""Measured samples in the place of filled channels."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.channels.filling import find_filling
from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel
from drivetwin.findings import Code, Finding
from drivetwin.logs.quality.consistency_checks import replace_filling
from tests.support.arrays import FloatArray


def make_channel(knots: FloatArray) -> Channel:
    """Return an output torque [N m] with noise, filled up from `knots` [s] to one row every ms."""
    noise = np.random.default_rng(2).standard_normal(knots.size)
    values = 2000.0 + 300.0 * np.sin(3.0 * knots) + 5.0 * noise
    time = np.arange(0.01, 4.9, 1e-3)
    return Channel(
        role="output_torque",
        quantity=Quantity.TORQUE,
        time=time,
        values=np.interp(time, knots, values),
        source_name="TrqOut",
        source_unit="Nm",
    )


def replace_found(channel: Channel) -> tuple[Channel, list[Finding]]:
    return replace_filling(channel, find_filling(channel.time, channel.values))


def test_measured_samples_replace_a_filled_channel() -> None:
    """The channel keeps its knots, and the finding states their period."""
    knots = np.arange(0.0, 5.0, 0.01)
    channel, findings = replace_found(make_channel(knots))
    assert [one.code for one in findings] == [Code.CHANNEL_FILLED]
    assert channel.time == pytest.approx(knots[1:491], abs=1e-12)


def test_a_filling_without_knots_is_named() -> None:
    """Messages two to four rows apart leave too few straight parts; the channel stays as it is."""
    knots = 1e-3 * np.cumsum(np.random.default_rng(4).uniform(2.0, 4.0, 1700))
    filled = make_channel(knots)
    channel, findings = replace_found(filled)
    assert [one.code for one in findings] == [Code.FILLING_UNKNOWN]
    assert channel.time is filled.time


def test_a_measured_channel_stays_as_it_is() -> None:
    """Noise at each row."""
    channel, findings = replace_found(make_channel(np.arange(0.0, 5.0, 1e-3)))
    assert findings == []
    assert channel.filling is None
