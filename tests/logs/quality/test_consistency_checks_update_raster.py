# SPDX-License-Identifier: MIT
"""Measured samples in the place of filled channels, and late samples of a coarse table."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin import read_arrays
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.findings import Code
from tests.support.arrays import FloatArray

TIME = np.round(np.arange(0.01, 4.9, 1e-3), 3)


def read(knots: FloatArray) -> ShiftLog:
    """Read an output torque [N m] with noise, filled up from `knots` [s] to one row every ms."""
    noise = np.random.default_rng(2).standard_normal(knots.size)
    values = 2000.0 + 300.0 * np.sin(3.0 * knots) + 5.0 * noise
    table = {"time": TIME, "TrqOut": np.interp(TIME, knots, values)}
    return read_arrays(table, None, {"TrqOut": "Nm"}, needed=())


def test_measured_samples_replace_a_filled_channel() -> None:
    """The channel keeps its knots, and the finding states their period."""
    knots = np.arange(0.0, 5.0, 0.01)
    log = read(knots)
    assert [one.code for one in log.findings] == [Code.CHANNEL_FILLED]
    assert log["output_torque"].time == pytest.approx(knots[1:491], abs=1e-9)


def test_a_filling_without_knots_is_named() -> None:
    """Messages two to four rows apart leave too few straight parts; the channel stays as it is."""
    log = read(1e-3 * np.cumsum(np.random.default_rng(4).uniform(2.0, 4.0, 1700)))
    assert [one.code for one in log.findings] == [Code.FILLING_UNKNOWN]
    assert log["output_torque"].time.size == TIME.size


def test_a_measured_channel_stays_as_it_is() -> None:
    """Noise at each row."""
    log = read(np.arange(0.0, 5.0, 1e-3))
    assert log.findings == ()
    assert log["output_torque"].time.size == TIME.size
