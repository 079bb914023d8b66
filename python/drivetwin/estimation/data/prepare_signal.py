# SPDX-License-Identifier: MIT
"""Preparation of one channel for the estimates: its samples and their noise."""

from __future__ import annotations

import numpy as np

from drivetwin._util.signal_processing import estimate_rounding_step
from drivetwin.channels.shiftlog import Channel
from drivetwin.estimation.data.noise import estimate_white_noise
from drivetwin.estimation.data.shift_data import MeasuredSignal


def prepare_signal(channel: Channel, factor: float = 1.0) -> MeasuredSignal:
    """Return the finite updates of a channel times `factor`, with their noise."""
    updates = channel.updates
    finite = np.isfinite(updates.values)
    values = factor * updates.values[finite]
    floor = estimate_rounding_step(values) / np.sqrt(12.0)
    return MeasuredSignal(
        updates.time[finite], values, max(estimate_white_noise(values), float(floor))
    )
