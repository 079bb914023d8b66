# SPDX-License-Identifier: MIT
"""Checks of one channel. A whole log would be searched for fillings too, which takes far longer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin.channels.roles import get_quantity
from drivetwin.channels.shiftlog import Channel
from drivetwin.findings import Finding
from drivetwin.logs.quality.channel_checks import check_channel
from drivetwin.logs.quality.consistency_checks import check_jumps
from tests.support.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Checked:
    """Channel after its checks, and their findings."""

    channel: Channel
    findings: tuple[Finding, ...]
    time: FloatArray

    @property
    def left_out(self) -> list[tuple[int, int]]:
        """Runs (start, end) of samples left out."""
        gone = ~np.isin(self.time, self.channel.time)
        edges = np.flatnonzero(np.diff(np.concatenate(([0], gone, [0]))))
        return [(int(start), int(end)) for start, end in edges.reshape(-1, 2)]


def check(role: str, values: FloatArray, unit: str = "", time: FloatArray | None = None) -> Checked:
    """Check `values` in SI, whose file states `unit`; 100 Hz by default."""
    time = np.round(np.arange(values.size) * 0.01, 2) if time is None else time
    measured = Channel(role, get_quantity(role), time, values, "X", unit)
    channel, findings = check_channel(measured, "log.csv")
    check_jumps(channel, {}, "log.csv")
    return Checked(channel, tuple(findings), time)
