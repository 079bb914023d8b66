# SPDX-License-Identifier: MIT
"""Frequency and damping of the driveline after a shift, from a shaft speed alone.

Without an output torque the oscillation shows in the gearbox speeds, beside that of road and engine
torque. A decay is accepted only where several windows that start one after the other agree on it;
anything else is refused.

Decaying sines on a quadratic trend are fitted by least squares, many windows at a time. Variable
projection: amplitudes and trend are linear, so that only decay rate and frequency are
searched, with the approximate Jacobian of Kaufman (1975) and the damping of Marquardt (1963).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray, Span
from drivetwin.errors import IdentificationError
from drivetwin.estimation.direct.ringdown import RING_DOWN
from drivetwin.likelihood.measured_signal import MeasuredSignal
from drivetwin.shifts.detect import split_at_gaps
from drivetwin.shifts.shift import Shift

_SCALE = np.array([2.0, 5.0])
"""Usual sizes of rate [1/s] and angular frequency [rad/s]."""
_STEPS = 25
"""Most steps of a search; a decay that stands out takes fewer than twelve."""
_CONVERGED = 1e-10
"""Relative decrease of the misfit at which a search has converged."""
_STUCK = 1e8
"""Damping from which on a search cannot descend further."""
_DIFFERENCE = 3e-6
"""Relative step of the differences that give a Jacobian."""
_STEEPEST = 50.0
"""Largest exponent of the decay."""
_SINGULAR = 1e-14
"""Share of the trace added to a Gram matrix, which is singular at zero frequency."""


@dataclass(frozen=True, eq=False)
class Windows:
    """Windows (w, n) of samples, padded at their end; `inside` is 1 for samples, 0 for padding.

    `rest` holds the values without their quadratic trend, `trend` (w, n, 3) an orthonormal basis of
    it. `time` [s] counts from the first sample of each window.
    """

    time: FloatArray
    inside: FloatArray
    rest: FloatArray
    trend: FloatArray

    @classmethod
    def stack(cls, times: Sequence[FloatArray], values: Sequence[FloatArray]) -> Windows:
        """Stack the samples of several windows; each has more than three."""
        shape = len(times), max(time.size for time in times)
        time, inside, padded = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        powers = np.zeros((*shape, 3))
        for index, (stamps, samples) in enumerate(zip(times, values, strict=True)):
            time[index, : stamps.size] = stamps
            inside[index, : stamps.size] = 1.0
            padded[index, : stamps.size] = samples
            powers[index, : stamps.size] = np.vander(stamps / stamps[-1], 3)
        trend = np.linalg.qr(powers)[0]
        return cls(time, inside, _remove(trend, padded[..., None])[..., 0], trend)

    def select(self, kept: NDArray[np.intp]) -> Windows:
        """Return the windows at the indices `kept` (k,)."""
        return Windows(self.time[kept], self.inside[kept], self.rest[kept], self.trend[kept])


def fit_decaying_sines(windows: Windows, omega: FloatArray, rate: float) -> FloatArray:
    """Return decay rate [1/s] and angular frequency [rad/s] of each window, (w, 2).

    The search starts at `omega` (w,) [rad/s] and `rate` [1/s].
    """
    found = np.column_stack([np.full(omega.size, rate), omega])
    damping = np.full(omega.size, 1e-3)
    active = np.arange(omega.size)
    for _ in range(_STEPS):
        part = windows.select(active)
        here = found[active]
        cost, slopes, curvature = _linearize(part, here)
        size = np.einsum("wii->wi", curvature)
        damped = curvature + damping[active, None, None] * size[:, :, None] * np.eye(2)
        step = -np.linalg.solve(damped + _tiny(size), slopes[..., None])[..., 0]
        gain = cost - compute_misfits(part, here + step)
        better = gain >= 0.0
        found[active[better]] += step[better]
        damping[active] *= np.where(better, 0.1, 10.0)
        converged = better & (gain <= _CONVERGED * cost)
        active = active[~converged & (damping[active] < _STUCK)]
        if not active.size:
            break
    return found


def compute_misfits(windows: Windows, parameters: FloatArray) -> FloatArray:
    """Sum of squares (w,) that the best sines of rate and frequency `parameters` (w, 2) leave."""
    return np.asarray(np.sum(_project(windows, parameters)[2] ** 2, axis=1))


def differentiate_residuals(windows: Windows, parameters: FloatArray) -> FloatArray:
    """Derivatives (w, n, 2) of the residuals by rate and frequency, amplitudes following."""
    slopes = []
    for index, size in enumerate(_SCALE):
        step = np.zeros(2)
        step[index] = _DIFFERENCE * size
        ahead, behind = (_project(windows, parameters + sign * step)[2] for sign in (1.0, -1.0))
        slopes.append((ahead - behind) / (2.0 * step[index]))
    return np.stack(slopes, axis=-1)


def _project(windows: Windows, parameters: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Sine columns without trend (w, n, 2), their amplitudes (w, 2) and residuals (w, n)."""
    columns = _remove(windows.trend, _make_sines(windows, parameters))
    amplitudes = _solve(columns, windows.rest[..., None])
    return columns, amplitudes[..., 0], windows.rest - (columns @ amplitudes)[..., 0]


def _make_sines(windows: Windows, parameters: FloatArray) -> FloatArray:
    """Decaying cosine and sine (w, n, 2), zero in the padding."""
    rate, omega = parameters[:, :1], parameters[:, 1:]
    fall = windows.inside * np.exp(-np.clip(rate * windows.time, -_STEEPEST, _STEEPEST))
    angle = omega * windows.time
    return np.stack([fall * np.cos(angle), fall * np.sin(angle)], axis=-1)


def _linearize(
    windows: Windows, parameters: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Misfit (w,), half its gradient (w, 2) and half its approximate Hessian (w, 2, 2)."""
    columns, amplitudes, residual = _project(windows, parameters)
    sines = _make_sines(windows, parameters)
    along = (sines @ amplitudes[..., None])[..., 0]
    across = sines[..., 0] * amplitudes[:, 1:] - sines[..., 1] * amplitudes[:, :1]
    change = windows.time[..., None] * np.stack([-along, across], axis=-1)
    change = _remove(windows.trend, change)
    jacobian = columns @ _solve(columns, change) - change
    turned = jacobian.transpose(0, 2, 1)
    slopes = (turned @ residual[..., None])[..., 0]
    return np.sum(residual**2, axis=1), slopes, turned @ jacobian


def _remove(basis: FloatArray, columns: FloatArray) -> FloatArray:
    """Columns (w, n, c) without their part in an orthonormal `basis` (w, n, b)."""
    return np.asarray(columns - basis @ (basis.transpose(0, 2, 1) @ columns))


def _solve(columns: FloatArray, targets: FloatArray) -> FloatArray:
    """Least-squares coefficients (w, 2, c) of `targets` (w, n, c) in `columns` (w, n, 2)."""
    turned = columns.transpose(0, 2, 1)
    gram = turned @ columns
    return np.asarray(np.linalg.solve(gram + _tiny(np.einsum("wii->wi", gram)), turned @ targets))


def _tiny(diagonal: FloatArray) -> FloatArray:
    """Matrices (w, 2, 2) that keep a system with this `diagonal` (w, 2) solvable."""
    smallest = np.finfo(float).tiny
    size = _SINGULAR * diagonal.sum(axis=1) + smallest
    return np.asarray(size[:, None, None] * np.eye(2))


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

_MIN_SAMPLES = 12
"""Fewest samples of a window."""
_UNKNOWNS = 7
"""Rate, frequency, two amplitudes and three coefficients of the trend."""
_FIRST_RATE = 2.0
"""Initial value of the decay rate [1/s]."""


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
    parts = [
        speed.select_span(span)
        for span in _list_spans(lockup, end)
        if split_at_gaps(span, speed.gaps) == (span,)
    ]
    found = [decay for decay in _fit_windows(parts) if decay.clean]
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


def _list_spans(lockup: float, end: float) -> list[Span]:
    """Windows [s] after `lockup` that end before `end`."""
    starts = np.arange(
        lockup + RESONANCE.first_start, lockup + RESONANCE.last_start, RESONANCE.step
    )
    spans = [(float(start), float(start + one)) for start in starts for one in RESONANCE.lengths]
    return [span for span in spans if span[1] <= end]


def _fit_windows(parts: Sequence[MeasuredSignal]) -> list[_Decay]:
    """Best decaying sine on a quadratic in each window; none in windows of too few samples."""
    sampled = [(part, *_reduce_samples(part)) for part in parts]
    sampled = [one for one in sampled if one[1].size >= _MIN_SAMPLES]
    if not sampled:
        return []
    kept, times, values = zip(*sampled, strict=True)
    windows = Windows.stack(times, values)
    fastest = np.array([_compute_fastest(time) for time in times])
    starts = [
        _find_strongest(time, rest[: time.size], limit)
        for time, rest, limit in zip(times, windows.rest, fastest, strict=True)
    ]
    best = fit_decaying_sines(windows, np.array(starts), _FIRST_RATE)
    left = compute_misfits(windows, best)
    slopes = differentiate_residuals(windows, best)
    scale = left / np.array([time.size - _UNKNOWNS for time in times])
    covariance = np.linalg.pinv(slopes.transpose(0, 2, 1) @ slopes) * scale[:, None, None]
    std = np.sqrt(np.einsum("wii->wi", covariance))
    power = np.sum(windows.rest**2, axis=1)
    return [
        _Decay(
            (float(part.time[0]), float(part.time[-1])),
            float(best[i, 0]),
            abs(float(best[i, 1])),
            float(std[i, 0]),
            float(std[i, 1]),
            1.0 - float(left[i] / power[i]),
        )
        for i, part in enumerate(kept)
        if power[i] > 0.0 and abs(best[i, 1]) <= fastest[i]
    ]


def _compute_fastest(time: FloatArray) -> float:
    """Angular frequency [rad/s] above which samples at `time` (n,) [s] are too far apart."""
    return RING_DOWN.max_nyquist_share * np.pi / float(np.median(np.diff(time)))


def _find_strongest(time: FloatArray, rest: FloatArray, fastest: float) -> float:
    """Angular frequency [rad/s] of most power in `rest` (n,), up to `fastest`."""
    low, high = (2.0 * np.pi * f for f in RING_DOWN.band)
    omega = np.linspace(low, min(high, fastest), RESONANCE.frequencies)
    return float(omega[np.abs(np.exp(1j * np.outer(omega, time)) @ rest).argmax()])


def _reduce_samples(part: MeasuredSignal) -> tuple[FloatArray, FloatArray]:
    """Time from the first sample [s] and value, means over FINEST where sampling is finer."""
    if part.time.size < 2:
        return part.time, part.values
    width = max(round(RESONANCE.min_step / float(np.median(np.diff(part.time)))), 1)
    usable = part.time.size // width * width
    time, values = (x[:usable].reshape(-1, width).mean(axis=1) for x in (part.time, part.values))
    return time - time[:1], values
