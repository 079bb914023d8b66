# SPDX-License-Identifier: MIT
"""Means and slopes of channels over a span of time."""

from __future__ import annotations

import numpy as np

from drivetwin._util.arrays import FloatArray, Span
from drivetwin.channels.shiftlog import Channel, ShiftLog
from drivetwin.vehicle.vehicle_card import VehicleCard

POINTS = 60
"""Instants at which a span is sampled."""


def sample_span(channel: Channel, span: Span) -> FloatArray:
    """Sample a channel at `POINTS` instants of a span; NaN outside its samples."""
    return channel.updates.interpolate(np.linspace(*span, POINTS))


def compute_mean(channel: Channel, span: Span) -> float:
    """Mean over a span; NaN if less than half of it is recorded."""
    values = sample_span(channel, span)
    known = np.isfinite(values)
    return float(values[known].mean()) if 2 * np.count_nonzero(known) > POINTS else float("nan")


def compute_slope(channel: Channel, span: Span) -> float:
    """Mean rate over a span [1/s] by a straight line; NaN if less than half of it is recorded."""
    values = sample_span(channel, span)
    known = np.isfinite(values)
    if 2 * np.count_nonzero(known) <= POINTS:
        return float("nan")
    time = np.linspace(*span, POINTS)
    return float(np.polyfit(time[known] - span[0], values[known], 1)[0])


def compute_engine_rate(log: ShiftLog, card: VehicleCard, span: Span) -> float:
    """ω_e' over a span [rad/s^2], of the engine speed or, without it, of the input speed."""
    if "engine_speed" in log:
        return compute_slope(log["engine_speed"], span)
    return (
        card.i_in.value * compute_slope(log["input_speed"], span)
        if "input_speed" in log
        else np.nan
    )


def compute_output_rate(log: ShiftLog, card: VehicleCard, span: Span) -> float:
    """ω_out' over a span [rad/s^2], of the output speed or, without it, of the wheel speed."""
    if "output_speed" in log:
        return compute_slope(log["output_speed"], span)
    if "wheel_speed" in log:
        return card.final_drive.value * compute_slope(log["wheel_speed"], span)
    return np.nan
