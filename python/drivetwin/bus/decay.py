# SPDX-License-Identifier: MIT
"""Resonance of the driveline in a gear, from the decays after all shifts into it together.

A shaft speed after lock-up is

    y = b0 + b1·t + e^(-σt)·(b2·cos ωt + b3·sin ωt) + e

with one σ and ω for the gear, and b of each decay its own. The noise e (see `drift`) contains a
drifting torque and a torque that drives the same oscillator: a forced vibration then informs on the
frequency like a stationary one, and not like a clean decay. Amplitudes and trend are linear and
drop out (separable least squares); σ and ω are searched for all decays at once.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from drivetwin._util.arrays import FloatArray, propagate_variance
from drivetwin.bus.drift import (
    NoiseSize,
    Regression,
    Swing,
    build_covariance,
    build_drift_kernel,
    build_swing_kernel,
    fit_noise,
    regress,
)
from drivetwin.bus.recording import Signal, average_neighbours
from drivetwin.bus.scatter import Combined, ShiftValue, combine
from drivetwin.bus.torque import compute_swing_response, integrate_torque
from drivetwin.estimation.direct.resonance import Windows, compute_misfits
from drivetwin.estimation.direct.ringdown import RING_DOWN
from drivetwin.findings import Code, Number, explain
from drivetwin.vehicle.spec import Z95


@dataclass(frozen=True)
class DecaySettings:
    """Settings of the joint fit of decays."""

    length: float = 2.0
    """Longest fitted span after lock-up [s]; a driveline oscillation has decayed by then."""
    min_length: float = 1.0
    """Shortest fitted span [s]: a few periods of a truck in gear."""
    min_periods: float = 2.0
    """Periods of the lowest frequency in the shortest fitted span [count]."""
    frequencies: int = 150
    """Frequencies at which the search starts [count]."""
    dampings: tuple[float, ...] = (0.02, 0.05, 0.1, 0.2)
    """Damping ratios at which the search starts [1]."""
    least_damping: float = 1e-3
    """Smallest damping ratio; no driveline is below [1]."""
    per_period: float = 6.0
    """Samples of a period that are left where neighbours are averaged [count]: the mean of a sine
    over a sixth of its period has 95 % of its amplitude."""
    samples: int = 80
    """Samples of a decay that are left where neighbours are averaged [count]."""
    max_damping: float = 0.3
    """Largest damping ratio of an oscillation [1]: a motion of more damping loses 86 % in a period
    and has no frequency of its own in noise."""
    max_sampling_share: float = 1.0 / 3.0
    """Highest frequency over the sampling rate [ratio]: three samples in a period are the fewest
    that separate rate, frequency, two amplitudes and a trend."""
    rounds: int = 8
    """Most alternations between noise and oscillator [count]."""
    converged: float = 1e-3
    """Step of an alternation at which the search ends [standard deviations]."""


DECAY = DecaySettings()


@dataclass(frozen=True, eq=False)
class DecayRecord:
    """Samples of one decay: `time` (n,) [s] from the first one, `values` (n,) [rad/s].

    `label` names log and shift, `start` [s] is the first sample in the time of the log. `floor`
    [rad/s] is the standard deviation of rounding. An engine `torque`, `late` [s], drives both the
    trend and the oscillation where it is recorded. `kind` is "upshifts" or "downshifts", empty
    where the gear before is not known.
    """

    label: str
    start: float
    time: FloatArray
    values: FloatArray
    floor: float
    torque: Signal | None = None
    late: float = 0.0
    kind: str = ""
    averaged: FloatArray | None = None
    """Times (n, w) [s] of the samples of each mean, None where each value is one sample."""

    def build_columns(self, swing: Swing) -> FloatArray:
        """Columns (n, 4) of trend and oscillation, two more of a torque."""
        time = self.time if self.averaged is None else self.averaged.ravel()
        columns = build_columns(time, swing)
        if self.torque is not None:
            impulse = integrate_torque(self.torque, self.start + time + self.late)
            driven = compute_swing_response(self.start + time, self.torque, self.late, swing)
            columns = np.column_stack([columns, impulse, driven])
        return average_neighbours(columns, time.size // self.time.size)

    def thin(self, swing: Swing) -> DecayRecord:
        """Return means of neighbours, so many that they still resolve the oscillation."""
        step = float(np.median(np.diff(self.time)))
        fine = int(2.0 * np.pi / swing.omega / DECAY.per_period / step)
        width = max(1, min(fine, self.time.size // DECAY.samples))
        time, values = (average_neighbours(one, width) for one in (self.time, self.values))
        return replace(
            self,
            start=self.start + float(time[0]),
            time=time - time[0],
            values=values,
            floor=self.floor / float(np.sqrt(width)),
            averaged=(self.time[: time.size * width] - time[0]).reshape(-1, width),
        )


@dataclass(frozen=True, eq=False)
class DecayFit:
    """One decay with the common oscillator: noise sizes, `fitted` (n,) mean without noise."""

    record: DecayRecord
    size: NoiseSize
    fitted: FloatArray


@dataclass(frozen=True, eq=False)
class JointDecay:
    """Oscillator of a gear: `combined` holds rate σ [1/s] and angular frequency ω [rad/s].

    `chance` is the probability with which noise alone passes for such an oscillation. `step` [s]
    is the longest sample interval of the records.
    """

    combined: Combined
    fits: tuple[DecayFit, ...]
    chance: float
    step: float

    @property
    def swing(self) -> Swing:
        """The oscillator."""
        return Swing(*map(float, self.combined.value))

    def compute_frequency(self) -> tuple[float, float]:
        """Damped frequency [Hz] and its standard deviation."""
        return self.swing.omega / (2.0 * np.pi), float(self.combined.std[1]) / (2.0 * np.pi)

    def compute_damping(self) -> tuple[float, float]:
        """Damping ratio and its standard deviation."""
        rate, omega = self.swing.rate, self.swing.omega
        norm = float(np.hypot(rate, omega))
        rate_std, omega_std = self.combined.std
        std = float(np.hypot(omega**2 * rate_std, rate * omega * omega_std)) / norm**3
        return rate / norm, std

    def explain_implausible(self) -> str:
        """Return why this is no oscillation of a driveline; empty if it may be one."""
        frequency, damping = self.compute_frequency()[0], self.compute_damping()[0]
        if damping > DECAY.max_damping:
            return explain(Code.BUS_DECAY_DAMPED, zeta=damping, limit=DECAY.max_damping)
        if frequency * self.step > DECAY.max_sampling_share:
            shown = {"f": Number(frequency, "Hz"), "rate": Number(1.0 / self.step, "Hz")}
            return explain(Code.BUS_DECAY_SAMPLED, **shown)
        longest = max(float(one.record.time[-1]) for one in self.fits)
        return explain(Code.BUS_NO_DECAY) if frequency * longest < 1.0 else ""


def build_columns(time: FloatArray, swing: Swing) -> FloatArray:
    """Columns (n, 4) of trend and oscillation."""
    fall = np.exp(-swing.rate * time)
    angle = swing.omega * time
    return np.column_stack([np.ones_like(time), time, fall * np.cos(angle), fall * np.sin(angle)])


def fit_decays(
    records: Sequence[DecayRecord], start: Swing | None = None, late_std: float = 0.0
) -> JointDecay | None:
    """Fit one oscillator to all decays of a gear; None if it is not determined.

    `start` is the oscillator that the search begins with, None to look for it. `late_std` [s] is
    the standard deviation of the dead time of the torque, an error that all decays have in common.
    """
    swing = start or _find_start(records)
    if swing is None:
        return None
    step = _compute_step(records)
    thinned = [one.thin(swing) for one in records]
    sizes = [_fit_size(one, swing, None) for one in thinned]
    for turn in range(DECAY.rounds):
        if turn:
            sizes = [_fit_size(one, swing, size) for one, size in zip(thinned, sizes, strict=True)]
        swing, left, _ = _climb(thinned, swing, sizes)
        if left is None:
            return None
        if left < DECAY.converged:
            break
    return _finish(thinned, swing, sizes, step, late_std)


def _climb(
    records: Sequence[DecayRecord], swing: Swing, sizes: Sequence[NoiseSize]
) -> tuple[Swing, float | None, FloatArray]:
    """Take a Newton step; return the oscillator after it, its size in standard deviations, None
    where the decays determine no step, and the information (2, 2) before it."""
    made = [_expand(one, swing, size) for one, size in zip(records, sizes, strict=True)]
    information = np.sum([one[1] for one in made], axis=0)
    move = _limit_step(swing, np.sum([one[0] for one in made], axis=0), information)
    if move is None:
        return swing, None, information
    return _move(swing, move), float(np.sqrt(move @ information @ move)), information


def _finish(
    records: Sequence[DecayRecord],
    swing: Swing,
    sizes: Sequence[NoiseSize],
    step: float,
    late_std: float,
) -> JointDecay | None:
    sizes = _raise_to_usual(sizes)
    values = [_find_own(one, swing, size) for one, size in zip(records, sizes, strict=True)]
    combined = combine(values)
    if combined is None:
        return None
    later = [replace(one, late=one.late + late_std) for one in records]
    moved = _climb(later, swing, sizes)[0]
    move = np.array([moved.rate - swing.rate, moved.omega - swing.omega])
    combined = replace(combined, covariance=combined.covariance + np.outer(move, move))
    found = Swing(max(float(combined.value[0]), 1e-9), float(combined.value[1]))
    fits = tuple(
        DecayFit(one, size, np.zeros(one.time.size) if made is None else made.mean)
        for one, size in zip(records, sizes, strict=True)
        for made in [_regress(one, found, size, one.build_columns(found))]
    )
    return JointDecay(combined, fits, _compute_chance(records, swing, sizes), step)


def _find_own(one: DecayRecord, swing: Swing, size: NoiseSize) -> ShiftValue:
    """Rate and angular frequency of one decay, the maximum that is nearest to the common `swing`.

    One Newton step would leave the range of its expansion where a decay contradicts the others.
    """
    for _ in range(DECAY.rounds):
        swing, left, information = _climb([one], swing, [size])
        if left is None or left < DECAY.converged:
            break
    return ShiftValue(one.label, np.array([swing.rate, swing.omega]), information, one.kind)


def _fit_size(one: DecayRecord, swing: Swing, start: NoiseSize | None) -> NoiseSize:
    return fit_noise(one.time, one.build_columns(swing), one.values, one.floor, swing, start)


def _regress(
    one: DecayRecord, swing: Swing | None, size: NoiseSize, columns: FloatArray
) -> Regression | None:
    covariance = build_covariance(one.time, size, one.floor, swing)
    return regress(columns, one.values, covariance)


def _score(one: DecayRecord, swing: Swing, size: NoiseSize) -> float:
    made = _regress(one, swing, size, one.build_columns(swing))
    return -np.inf if made is None else made.log_likelihood


def _expand(one: DecayRecord, swing: Swing, size: NoiseSize) -> tuple[FloatArray, FloatArray]:
    """Slope (2,) and information (2, 2) of the log likelihood by rate and angular frequency."""
    step = np.array([0.02 * max(swing.rate, 0.02 * swing.omega), 2e-3 * swing.omega])
    here = _score(one, swing, size)
    ends = np.array(
        [[_score(one, _move(swing, sign * step * e), size) for sign in (1, -1)] for e in np.eye(2)]
    )
    slope = (ends[:, 0] - ends[:, 1]) / (2.0 * step)
    curve = np.diag((2.0 * here - ends.sum(axis=1)) / step**2)
    both = [
        a * b * _score(one, _move(swing, step * np.array([a, b])), size)
        for a in (1, -1)
        for b in (1, -1)
    ]
    curve[0, 1] = curve[1, 0] = -sum(both) / (4.0 * step[0] * step[1])
    size_, axes = np.linalg.eigh(curve * np.outer(step, step))
    kept = (axes * np.maximum(size_, 0.0)) @ axes.T / np.outer(step, step)
    return slope, np.asarray(kept)


def _move(swing: Swing, step: FloatArray) -> Swing:
    omega = swing.omega + float(step[1])
    return Swing(max(swing.rate + float(step[0]), DECAY.least_damping * omega), omega)


def _limit_step(swing: Swing, slope: FloatArray, information: FloatArray) -> FloatArray | None:
    """Newton step, at most a tenth of the frequency and half of the rate."""
    size = np.linalg.eigvalsh(information)
    if not size[0] > 1e-12 * size[1]:
        return None
    step = np.linalg.solve(information, slope)
    largest = np.array([0.5 * max(swing.rate, 0.02 * swing.omega), 0.1 * swing.omega])
    return np.asarray(step * min(1.0, float(np.min(largest / np.maximum(np.abs(step), 1e-30)))))


def _find_start(records: Sequence[DecayRecord]) -> Swing | None:
    """Oscillator that explains most of all decays by plain least squares."""
    shortest = min(float(one.time[-1]) for one in records)
    slowest = DECAY.min_periods / shortest
    fastest = min(RING_DOWN.band[1], DECAY.max_sampling_share / _compute_step(records))
    if not slowest < fastest:
        return None
    trials = [
        Swing(damping * omega, omega)
        for omega in 2.0 * np.pi * np.geomspace(slowest, fastest, DECAY.frequencies)
        for damping in DECAY.dampings
    ]
    windows = Windows.stack([one.time for one in records], [one.values for one in records])
    sizes = np.array([one.time.size for one in records])
    least = sizes * np.array([one.floor for one in records]) ** 2

    def score(swing: Swing) -> float:
        each = np.full((len(records), 2), (swing.rate, swing.omega))
        return float(sizes @ np.log(compute_misfits(windows, each) + least))

    return min(trials, key=score)


def _compute_step(records: Sequence[DecayRecord]) -> float:
    """Longest median sample interval [s] of the records."""
    return max(float(np.median(np.diff(one.time))) for one in records)


def _compute_chance(
    records: Sequence[DecayRecord], swing: Swing, sizes: Sequence[NoiseSize]
) -> float:
    """Probability of the gain in likelihood over a drifting speed that does not oscillate.

    The amplitudes of each decay are tested, and the frequencies searched count as trials.
    """
    gain = 0.0
    for one, size in zip(records, sizes, strict=True):
        still = np.delete(one.build_columns(swing), (2, 3), axis=1)
        without = fit_noise(one.time, still, one.values, one.floor, None)
        both = _regress(one, swing, size, one.build_columns(swing))
        plain = _regress(one, None, without, still)
        gain += -np.inf if both is None else both.best
        gain -= -np.inf if plain is None else plain.best
    tested = 3 * len(records)
    return float(min(1.0, DECAY.frequencies * chdtrc(tested, max(2.0 * gain, 0.0))))


@dataclass(frozen=True, eq=False)
class DecayPrediction:
    """Prediction of a decay by the oscillator of other shifts.

    The first `used` samples give its amplitude, phase and trend; `mean` (n,) and `std` (n,) [rad/s]
    are those of a sample.
    """

    record: DecayRecord
    used: int
    mean: FloatArray
    std: FloatArray

    @property
    def predicted(self) -> NDArray[np.intp]:
        """Indices (m,) of the samples that took no part."""
        return np.arange(self.used, self.record.time.size, dtype=np.intp)

    @property
    def share_inside(self) -> float:
        """Share of the predicted samples inside the 95 % band."""
        k = self.predicted
        far = np.abs(self.record.values[k] - self.mean[k]) <= Z95 * self.std[k]
        return float(np.mean(far))

    @property
    def error(self) -> float:
        """Root mean square error of the predicted samples [rad/s]."""
        k = self.predicted
        return _compute_rms(self.record.values[k] - self.mean[k])

    @property
    def oscillation(self) -> float:
        """Root mean square of the predicted samples about their own line [rad/s]."""
        return self._leave_line(self.predicted)

    @property
    def trend_alone(self) -> float:
        """Root mean square error of the line through the first samples [rad/s]."""
        return self._leave_line(np.arange(self.used))

    def _leave_line(self, through: NDArray[np.intp]) -> float:
        """Compute the deviation of the predicted samples from the line through some samples."""
        time, values, k = self.record.time, self.record.values, self.predicted
        line = np.polyfit(time[through], values[through], 1)
        return _compute_rms(values[k] - np.polyval(line, time[k]))


def _compute_rms(error: FloatArray) -> float:
    return float(np.sqrt(np.mean(error**2)))


def predict_decay(joint: JointDecay, record: DecayRecord, periods: float = 1.0) -> DecayPrediction:
    """Predict a decay that took no part in `joint` from its first `periods` of the oscillation.

    The noise has the median sizes of the fitted decays. The band contains the noise, the state
    estimated from the first samples, and the interval of the oscillator with the scatter.
    """
    swing = joint.swing
    record = record.thin(swing)
    used = int(np.searchsorted(record.time, periods * 2.0 * np.pi / swing.omega))
    used = min(max(used, 8), record.time.size)
    size = _take_median([one.size for one in joint.fits])
    mean, variance = _extrapolate(record, used, swing, size)
    spread = joint.combined.covariance + np.diag(joint.combined.tau**2)
    root = np.linalg.cholesky(spread + 1e-12 * np.diag(np.diag(spread)))
    # Unscented: the mean depends on the frequency by more than its first derivative.
    points = [_move(swing, sign * np.sqrt(2.0) * root[:, k]) for k in (0, 1) for sign in (1, -1)]
    others = [_extrapolate(record, used, one, size)[0] for one in points]
    variance = variance + np.mean([(one - mean) ** 2 for one in others], axis=0)
    return DecayPrediction(record, used, mean, np.sqrt(variance))


def _take_median(sizes: Sequence[NoiseSize]) -> NoiseSize:
    rows = np.array([astuple(one) for one in sizes])
    return NoiseSize(*map(float, np.sqrt(np.median(rows**2, axis=0))))


def _raise_to_usual(sizes: Sequence[NoiseSize]) -> list[NoiseSize]:
    """Raise each noise to the median of the decays: the few periods of a decay determine its noise
    to a factor, and a small one by chance would outweigh all others."""
    usual = astuple(_take_median(sizes))
    return [NoiseSize(*np.maximum(astuple(one), usual).tolist()) for one in sizes]


def _extrapolate(
    record: DecayRecord, used: int, swing: Swing, size: NoiseSize
) -> tuple[FloatArray, FloatArray]:
    """Mean (n,) and variance (n,) of a sample, given the first `used` samples."""
    time = record.time
    columns = record.build_columns(swing)
    whole = build_covariance(time, size, record.floor, swing)
    drift = size.drift**2 * build_drift_kernel(time, time[:used])
    across = drift + size.swing**2 * build_swing_kernel(time, time[:used], swing)
    inverse = np.linalg.inv(whole[:used, :used])
    weights = across @ inverse
    first = columns[:used]
    beta_covariance = np.asarray(np.linalg.inv(first.T @ inverse @ first), dtype=np.float64)
    beta = beta_covariance @ (first.T @ (inverse @ record.values[:used]))
    mean = columns @ beta + weights @ (record.values[:used] - first @ beta)
    left = columns - weights @ first
    variance = np.diag(whole) - np.einsum("ij,ij->i", weights, across)
    variance = variance + propagate_variance(left, beta_covariance)
    return np.asarray(mean), np.asarray(np.maximum(variance, size.white**2 + record.floor**2))
