# SPDX-License-Identifier: MIT
"""Frequency and damping of the driveline after a shift, from a shaft speed alone.

Without an output torque the oscillation shows in the gearbox speeds, beside that of road and engine
torque. A decay is accepted only where several windows that start one after the other agree on it;
anything else is refused.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from drivetwin._util.arrays import FloatArray, Span
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.estimation.linear.ringdown import RING_DOWN
from drivetwin.shifts.coverage import split_at_gaps
from drivetwin.shifts.shift import Shift


@dataclass(frozen=True)
class ResonanceSettings:
    """Settings of the search for the resonance of the driveline in a speed."""

    first_start: float = 0.02
    """First start of a window after lock-up [s]."""
    last_start: float = 0.42
    """Last start of a window after lock-up [s]; a later oscillation is not caused by the shift."""
    step: float = 0.04
    """Distance of the starts [s]."""
    lengths: tuple[float, ...] = (0.5, 0.6, 0.7, 0.8, 1.0)
    """Lengths of the windows [s]."""
    frequencies: int = 150
    """Frequencies whose power gives the initial value of a fit [count]."""
    min_explained: float = 0.93
    """Share of the variance about the trend that a decaying sine must explain [ratio]."""
    min_step: float = 5e-3
    """Samples closer than this are averaged first [s]."""
    min_periods: float = 2.5
    """Fewest periods in a window [count]."""
    min_decay: float = 4.0
    """Smallest significant decay rate [standard deviations]."""
    max_damping: float = 0.3
    """Largest damping ratio of an oscillation [1]."""
    min_agreeing: int = 2
    """Fewest windows with consistent results [count]."""


RESONANCE = ResonanceSettings()


@dataclass(frozen=True)
class Resonance:
    """Damped frequency `f_d` [Hz] and damping ratio, with one standard deviation each.

    `windows` of the log agree on it; `span` [s] is what they cover.
    """

    f_d: float
    f_d_std: float
    zeta: float
    zeta_std: float
    windows: int
    span: Span


@dataclass(frozen=True)
class _Decay:
    """One fitted window: decay rate [1/s] and ω_d [rad/s] with standard deviations."""

    span: Span
    rate: float
    omega: float
    rate_std: float
    omega_std: float
    explained: float

    @property
    def zeta(self) -> float:
        return self.rate / float(np.hypot(self.rate, self.omega))

    @property
    def clean(self) -> bool:
        periods = (self.span[1] - self.span[0]) * self.omega / (2.0 * np.pi)
        return (
            self.explained > RESONANCE.min_explained
            and periods >= RESONANCE.min_periods
            and self.rate > RESONANCE.min_decay * self.rate_std
            and self.zeta < RESONANCE.max_damping
            and RING_DOWN.band[0] < self.omega / (2.0 * np.pi) < RING_DOWN.band[1]
        )


def find_shift_resonance(speed: MeasuredSignal, shift: Shift) -> Resonance | str:
    """Estimate the resonance in the gear that a shift ends in from the input speed [rad/s].

    Returns the reason if there is none.
    """
    try:
        return fit_resonance(speed, shift.lockup_time, shift.after[1])
    except IdentificationError as refusal:
        return refusal.what


def fit_resonance(speed: MeasuredSignal, lockup: float, end: float) -> Resonance:
    """Decay of a shaft speed [rad/s] in the gear held from `lockup` to `end` [s].

    The standard deviations hold the spread between the windows. Raises IdentificationError where
    there is no clean decay.
    """
    found = []
    for start in np.arange(
        lockup + RESONANCE.first_start, lockup + RESONANCE.last_start, RESONANCE.step
    ):
        for length in RESONANCE.lengths:
            span = (float(start), float(start + length))
            if span[1] <= end and split_at_gaps(span, speed.gaps) == (span,):
                decay = _fit_window(speed.select_span(span))
                if decay is not None and decay.clean:
                    found.append(decay)
    if len({decay.span[0] for decay in found}) < RESONANCE.min_agreeing:
        raise IdentificationError(
            "no clean decay after lock-up: what oscillates there is driven by engine or road",
            "record a shift with a firm lock-up on an even road, pedal held still",
        )
    f = np.array([decay.omega for decay in found]) / (2.0 * np.pi)
    f_std = np.array([decay.omega_std for decay in found]) / (2.0 * np.pi)
    zeta = np.array([decay.zeta for decay in found])
    zeta_std = np.array([decay.rate_std / np.hypot(decay.rate, decay.omega) for decay in found])
    return Resonance(
        float(f.mean()),
        float(np.hypot(f_std.mean(), f.std(ddof=1))),
        float(zeta.mean()),
        float(np.hypot(zeta_std.mean(), zeta.std(ddof=1))),
        len(found),
        (min(decay.span[0] for decay in found), max(decay.span[1] for decay in found)),
    )


def _fit_window(part: MeasuredSignal) -> _Decay | None:
    """Best decaying sine on a quadratic in one window; None with too few samples."""
    time, values = _reduce_samples(part)
    if time.size < 12:
        return None
    trend = np.vander(time / time[-1], 3)
    rest = values - trend @ np.linalg.lstsq(trend, values, rcond=None)[0]
    power = float(rest @ rest)
    if power == 0.0:
        return None

    def projected(p: FloatArray) -> FloatArray:
        fall = np.exp(-np.clip(p[0] * time, -50.0, 50.0))
        swing = [fall * np.cos(p[1] * time), fall * np.sin(p[1] * time)]
        q, _ = np.linalg.qr(np.column_stack([*swing, trend]))
        return np.asarray(values - q @ (q.T @ values), dtype=float)

    fastest = RING_DOWN.max_nyquist_share * np.pi / float(np.median(np.diff(time)))
    omega = np.linspace(
        2.0 * np.pi * RING_DOWN.band[0],
        min(2.0 * np.pi * RING_DOWN.band[1], fastest),
        RESONANCE.frequencies,
    )
    strongest = omega[np.abs(np.exp(1j * np.outer(omega, time)) @ rest).argmax()]
    best = least_squares(projected, (2.0, strongest), x_scale=(2.0, 5.0), method="lm")
    if abs(best.x[1]) > fastest:
        return None
    left = 2.0 * float(best.cost)
    slopes = np.asarray(best.jac, dtype=float)
    covariance = np.linalg.pinv(slopes.T @ slopes) * left / (time.size - 7)
    std = np.sqrt(np.diag(covariance))
    return _Decay(
        (float(part.time[0]), float(part.time[-1])),
        float(best.x[0]),
        abs(float(best.x[1])),
        float(std[0]),
        float(std[1]),
        1.0 - left / power,
    )


def _reduce_samples(part: MeasuredSignal) -> tuple[FloatArray, FloatArray]:
    """Time from the first sample [s] and value, means over FINEST where sampling is finer."""
    if part.time.size < 2:
        return part.time, part.values
    width = max(round(RESONANCE.min_step / float(np.median(np.diff(part.time)))), 1)
    usable = part.time.size // width * width
    time, values = (x[:usable].reshape(-1, width).mean(axis=1) for x in (part.time, part.values))
    return time - time[:1], values
