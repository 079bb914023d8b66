# SPDX-License-Identifier: MIT
"""Ratio and delay between two shaft speeds that one gear joins, over all spans held.

    ω_a(t) = i·ω_b(t + τ) + e

τ is how much later the bus shows ω_b than ω_a. The regression is linear about the last i and τ;
the noise has a white part and a drift. τ is one number for all spans, i one for each gear.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray, Span
from drivetwin.bus.drift import build_covariance, fit_noise, solve_weighted
from drivetwin.bus.recording import Signal
from drivetwin.bus.scatter import ShiftValue
from drivetwin.estimation.direct.momentum_balance import interpolate_parabola_minimum


@dataclass(frozen=True)
class AlignmentSettings:
    """Settings of delays between speeds."""

    longest: float = 0.15
    """Largest delay [s] that is looked for; a bus shows no speed later."""
    edge: float = 0.05
    """Left out at both ends of a gear held, where the clutch may still slip [s]."""
    beside: float = 0.03
    """Time recorded beside a part once the delay is known [s]."""
    step: float = 2e-3
    """Distance of the first trials [s]."""
    length: float = 2.0
    """Longest part of a span that is fitted as one [s]."""
    min_samples: int = 12
    """Fewest samples of a part [count]."""


ALIGNMENT = AlignmentSettings()


@dataclass(frozen=True, eq=False)
class JoinedSpan:
    """Samples of ω_a, `time` (n,) and `values` (n,) [rad/s], in a span in which a gear joins it to
    `other`."""

    label: str
    gear: str
    time: FloatArray
    values: FloatArray
    floor: float
    other: Signal


@dataclass(frozen=True, eq=False)
class Alignment:
    """Estimates of all spans: delay [s] (1,) of each, and ratio (1,) of each by gear."""

    delays: tuple[ShiftValue, ...]
    ratios: dict[str, tuple[ShiftValue, ...]]


def split_span(
    label: str, gear: str, span: Span, signal: Signal, other: Signal, margin: float
) -> list[JoinedSpan]:
    """Cut the samples of `signal` in `span` into parts that are fitted separately.

    `other` is recorded `margin` [s] before and after each of them.
    """
    edge = ALIGNMENT.edge
    span = (
        max(span[0] + edge, float(other.time[0]) + margin),
        min(span[1] - edge, float(other.time[-1]) - margin),
    )
    time, values = signal.select(span)
    if time.size < ALIGNMENT.min_samples:
        return []
    count = max(1, int(np.ceil((time[-1] - time[0]) / ALIGNMENT.length)))
    parts = np.array_split(np.arange(time.size), count)
    return [
        JoinedSpan(f"{label} at {time[k[0]]:.2f} s", gear, time[k], values[k], signal.floor, other)
        for k in parts
        if k.size >= ALIGNMENT.min_samples
    ]


def estimate_delay(spans: Sequence[JoinedSpan]) -> float | None:
    """Delay [s] of plain least squares, for a first look; None without a span."""
    if not spans:
        return None
    trials = np.arange(-ALIGNMENT.longest, ALIGNMENT.longest, ALIGNMENT.step)
    costs = [sum(_fit_ratio(one, late)[1] for one in spans) for late in trials.tolist()]
    return interpolate_parabola_minimum(trials, np.array(costs))


def estimate_alignment(spans: Sequence[JoinedSpan], late: float | None = None) -> Alignment | None:
    """Estimate delay and ratios about a first delay `late` [s], None to look for it; None without a
    span that is long enough."""
    if not spans:
        return None
    late = (estimate_delay(spans) or 0.0) if late is None else late
    ratios = [_fit_ratio(one, late)[0] for one in spans]
    made = [_linearize(one, i, late) for one, i in zip(spans, ratios, strict=True)]
    delays: list[ShiftValue] = []
    by_gear: dict[str, list[ShiftValue]] = {}
    for one, (found, covariance) in zip(spans, made, strict=True):
        delays.append(_make_value(one.label, late + found[1], covariance[1, 1]))
        variance = covariance[0, 0] + found[0] ** 2 * _compute_rounding(one)
        by_gear.setdefault(one.gear, []).append(_make_value(one.label, found[0], variance))
    return Alignment(tuple(delays), {gear: tuple(each) for gear, each in by_gear.items()})


def _make_value(label: str, value: float, variance: float) -> ShiftValue:
    information = 1.0 / variance if variance > 0.0 else 0.0
    return ShiftValue(label, np.array([value]), np.array([[information]]))


def _compute_rounding(one: JoinedSpan) -> float:
    """Compute the relative variance of a ratio by rounding errors that do not average out.

    While a speed shows one number, all its samples have about the same error. Over the numbers that
    it passes through, the mean error falls with their count.
    """
    other = one.other.select((float(one.time[0]), float(one.time[-1])))[1]
    errors = [
        floor / np.mean(values) / max(1.0, float(np.ptp(values)) / (np.sqrt(12.0) * floor))
        for values, floor in ((one.values, one.floor), (other, one.other.floor))
        if floor > 0.0 and values.size
    ]
    return float(np.sum(np.square(errors)))


def _fit_ratio(one: JoinedSpan, late: float) -> tuple[float, float]:
    """Least-squares ratio and sum of squares at a delay."""
    other = one.other.interpolate_smoothly(one.time + late)
    ratio = float(other @ one.values / (other @ other))
    return ratio, float(np.sum((one.values - ratio * other) ** 2))


def _build_columns(one: JoinedSpan, ratio: float, late: float) -> FloatArray:
    """Derivatives (n, 2) of ω_a by ratio and delay."""
    other = one.other.interpolate_smoothly(one.time + late)
    rate = ratio * np.interp(one.time + late, one.other.time, one.other.slopes)
    return np.column_stack([other, rate])


def _linearize(one: JoinedSpan, ratio: float, late: float) -> tuple[FloatArray, FloatArray]:
    """Ratio and step of the delay (2,) with their covariance (2, 2), about `ratio` and `late`."""
    columns = _build_columns(one, ratio, late)
    time = one.time - one.time[0]
    size = fit_noise(time, columns, one.values, one.floor, None)
    weights = np.asarray(
        np.linalg.inv(build_covariance(time, size, one.floor, None)), dtype=np.float64
    )
    found, information = solve_weighted(columns, one.values, weights)
    return found, np.asarray(np.linalg.pinv(information, hermitian=True), dtype=np.float64)
