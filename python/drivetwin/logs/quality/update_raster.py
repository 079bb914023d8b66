# SPDX-License-Identifier: MIT
"""Update raster of recorded channels, filled ones, and tables whose rows show values late."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from drivetwin.channels.filling import Filling, FillKind
from drivetwin.channels.roles import AUXILIARY
from drivetwin.channels.shiftlog import Channel
from drivetwin.findings import Code, Finding, Number, report

_COARSE = 2.1e-3
"""Step of a table [s] above which it matters how much later than its message a value is shown: with
rows of 2 ms, however their stamps are rounded, its time is known to a millisecond and better."""


def replace_filling(channel: Channel, filling: Filling | None) -> tuple[Channel, list[Finding]]:
    """Reduce a channel that was filled up to its measured samples; return it and findings.

    Comes before all other checks, which assume the noise of measured samples.
    """
    if filling is None:
        return channel, []
    if filling.kind is FillKind.UNKNOWN:
        return replace(channel, filling=filling), [report(Code.FILLING_UNKNOWN, "", channel.place)]
    period, step = Number(filling.period, "s"), Number(filling.step, "s")
    measured = replace(channel, time=filling.time, values=filling.values, filling=filling)
    return measured, [
        report(
            Code.CHANNEL_FILLED,
            "",
            channel.place,
            period=period,
            step=step,
            kind=filling.kind.value,
        )
    ]


def mark_late_samples(channels: Mapping[str, Channel]) -> tuple[dict[str, Channel], list[Finding]]:
    """Mark channels as `late` that a coarse table repeats; return them by role, and findings.

    The arrival of their messages within a row is unknown. Channels with stamps of their own have
    those of the messages.
    """
    measured = {role: one for role, one in channels.items() if one.quantity not in AUXILIARY}
    held = [one for one in measured.values() if one.held]
    if not held:
        return dict(channels), []
    rows = max(measured.values(), key=lambda one: one.time.size)
    if rows.step <= _COARSE:
        return dict(channels), []
    recorded = [one for one in measured.values() if one.filling is None]
    if not all(np.isin(one.time, rows.time).all() for one in recorded):
        return dict(channels), []
    names = ", ".join(repr(one.source_name) for one in held)
    aged = {role: replace(one, late=rows.step) for role, one in measured.items()}
    step = Number(rows.step, "s")
    return {**channels, **aged}, [report(Code.TABLE_ROWS_COARSE, step=step, channels=names)]
