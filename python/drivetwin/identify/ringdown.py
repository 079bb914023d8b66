# SPDX-License-Identifier: MIT
"""Frequency and damping of the lock-up oscillation in the output torque.

The paper's way reads them from the extremes of the curve. The better way starts from a matrix
pencil (Hua and Sarkar 1990) and fits one decaying sine on a quadratic; what a moving engine
torque adds is the response of the same oscillator to it. Jitter of that torque is its sensor's, or
the engine's own, which drives the oscillation too: the share of it that does is fitted as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares
from scipy.signal import cont2discrete, lfilter

from drivetwin.errors import IdentificationError
from drivetwin.identify.signals import FloatArray, Sampled
from drivetwin.identify.unseen_torque import Left, covariance, hats, knots_of
from drivetwin.identify.wlse import window_edges, window_means
from drivetwin.shifts.recorded import parts_between

START_AFTER_LOCKUP = 0.05
"""Latest start of the fit after lock-up [s]; a ring at 30 Hz has lost most of its power by then."""
SHORTEST = 0.15
"""Shortest stretch fitted [s]."""
FEWEST = 20
"""Fewest samples fitted."""
LONGEST = 1.6
"""Longest stretch fitted [s]: by then a drivetrain oscillation has died away."""
BAND = (2.0, 60.0)
"""Frequencies [Hz] in which a driveline's first torsional mode is looked for."""
FASTEST = 0.8
"""Highest frequency told, as a share of half the sampling rate."""
CHANCE = 1e-6
"""Probability with which noise alone may pass for an oscillation. So small, for one that just
passes owes much of its size to noise, and what noise and ring make together decays too slowly."""
SURE = 5
"""Columns of a ring-down's basis without jitter: the two of the sine, three of the trend."""


@dataclass(frozen=True, eq=False)
class RingDown:
    """Decay rate σ [1/s] and damped frequency ω_d [rad/s], `covariance` (2, 2) of the two.

    Evidence: `time` [s], `torque` [N m] measured and `fitted` (both (n,)); `extremes_time`,
    `extremes_torque` where the values were read from extremes (else empty).
    """

    decay_rate: float
    omega_d: float
    covariance: FloatArray
    time: FloatArray
    torque: FloatArray
    fitted: FloatArray
    extremes_time: FloatArray
    extremes_torque: FloatArray

    @property
    def f_d(self) -> float:
        """Damped frequency [Hz]."""
        return self.omega_d / (2.0 * np.pi)

    @property
    def zeta(self) -> float:
        """Damping ratio ζ = σ/sqrt(σ² + ω_d²)."""
        return self.decay_rate / float(np.hypot(self.decay_rate, self.omega_d))

    @property
    def f_d_std(self) -> float:
        """Standard error of `f_d` [Hz]."""
        return float(np.sqrt(self.covariance[1, 1])) / (2.0 * np.pi)

    @property
    def zeta_std(self) -> float:
        """Standard error of ζ."""
        norm = np.hypot(self.decay_rate, self.omega_d) ** 3
        slope = np.array([self.omega_d**2, -self.decay_rate * self.omega_d]) / norm
        return float(np.sqrt(slope @ self.covariance @ slope))


@dataclass(frozen=True, eq=False)
class Drive:
    """Engine torque [N m] as measured, at the instants it acts, and its static gain on T_o."""

    torque: Sampled
    gain: float


@dataclass(frozen=True, eq=False)
class _Push:
    """What the engine torque does to a stiff shaft's T_o [N m], at the instants fitted (n,).

    `sure` is that without jitter, less its first value; `jitter` (n, 1), or (n, 0) where there is
    none. `density` [N²m²s] is the power density of the noise that is left in `sure`, should the
    jitter be the sensor's.
    """

    sure: FloatArray
    jitter: FloatArray
    density: FloatArray


def _push(drive: Drive | None, time: FloatArray) -> _Push:
    if drive is None:
        return _Push(np.zeros_like(time), np.empty((time.size, 0)), np.zeros_like(time))
    measured, calm = drive.torque, quiet(drive.torque)
    sure = drive.gain * calm.at(time)
    jitter = drive.gain * measured.at(time) - sure
    jumps = np.ptp(jitter) > 1e-3 * drive.gain * measured.sigma
    as_measured = np.interp(time, calm.time, (calm.values == measured.values).astype(float))
    period = float(np.median(np.diff(measured.time)))
    density = (drive.gain * measured.sigma) ** 2 * period * as_measured
    return _Push(sure - sure[0], jitter[:, None][:, : int(jumps)], density)


def _refuse(what: str) -> IdentificationError:
    return IdentificationError(
        f"no clean lock-up oscillation: {what}",
        "record at least 0.5 s in the new gear after a shift with a firm lock-up, pedal held still",
    )


def _stretch(torque: Sampled, lockup: float, end: float, after: float) -> Sampled:
    span = (lockup + after, min(end, lockup + LONGEST))
    for whole in parts_between(span, torque.gaps):
        part = torque.within(whole)
        if part.time.size >= FEWEST and part.time[-1] - part.time[0] >= SHORTEST:
            return part
    raise _refuse(f"less than {SHORTEST:g} s of the new gear are left after lock-up")


def _quadratic(time: FloatArray) -> FloatArray:
    u = (time - time[0]) / (time[-1] - time[0])
    return np.column_stack([np.ones_like(u), u, u * u])


def paper_ringdown(torque: Sampled, lockup: float, end: float) -> RingDown:
    """Frequency from the spacing of the extremes of T_o, damping from their logarithmic decrement.

    T_o is averaged over 10 ms windows; half the difference of neighbouring extremes falls by
    exp(-σ·T/2). Extremes count while they exceed four times the noise of an average.
    """
    part = _stretch(torque, lockup, end, START_AFTER_LOCKUP)
    edges = window_edges((part.time[0], part.time[-1]))
    mean, centre = window_means(part, edges), 0.5 * (edges[1:] + edges[:-1])
    count = max(part.time.size / mean.size, 1.0)
    floor = 4.0 * torque.sigma / np.sqrt(count) + 1e-3 * float(np.ptp(mean))
    turn = np.flatnonzero(np.diff(np.sign(np.diff(mean))) != 0) + 1
    picked: list[int] = []
    for k in turn:
        if picked and abs(mean[k] - mean[picked[-1]]) < 2.0 * floor:
            break
        picked.append(int(k))
    if len(picked) < 4:
        raise _refuse(f"only {len(picked)} extremes stand out of the noise")
    at = np.asarray(picked)
    bend = mean[at - 1] - 2.0 * mean[at] + mean[at + 1]
    shift = 0.5 * (mean[at - 1] - mean[at + 1]) / bend
    instants = centre[at] + shift * (centre[1] - centre[0])
    order = np.arange(at.size)
    half_period = float(np.polyfit(order, instants, 1)[0])
    swing = np.log(0.5 * np.abs(np.diff(mean[at])))
    decrement = -float(np.polyfit(order[:-1], swing, 1)[0])
    rate, omega = decrement / half_period, np.pi / half_period
    if not (rate > 0.0 and BAND[0] < omega / (2 * np.pi) < BAND[1]):
        raise _refuse(f"decay rate {rate:.3g} 1/s at {omega / (2 * np.pi):.3g} Hz")
    return RingDown(
        rate, omega, np.zeros((2, 2)), part.time, part.values, part.values, instants, mean[at]
    )


def pencil_start(time: FloatArray, values: FloatArray, order: int = 6) -> tuple[float, float]:
    """Decay rate [1/s] and frequency [rad/s] of the strongest mode in `BAND`, by matrix pencil.

    `values` (n,) over equidistant `time` (n,), trend removed; it is thinned to about 200 samples.
    """
    thin = max(values.size // 200, 1)
    usable = values.size // thin * thin
    y = values[:usable].reshape(-1, thin).mean(axis=1)
    h = thin * (time[-1] - time[0]) / (time.size - 1)
    length = y.size // 3
    hankel = np.lib.stride_tricks.sliding_window_view(y, length + 1)
    basis = np.linalg.eigh(hankel.T @ hankel)[1][:, -order:].T
    poles = np.linalg.eigvals(np.linalg.pinv(basis[:, :-1].T) @ basis[:, 1:].T)
    powers = np.vander(poles, y.size, increasing=True).T
    amplitude = np.abs(np.linalg.lstsq(powers, y.astype(complex), rcond=None)[0])
    rates = np.log(np.where(poles == 0.0, 1e-300, poles)) / h
    frequency = rates.imag / (2.0 * np.pi)
    good = (frequency > BAND[0]) & (frequency < BAND[1]) & (rates.real < 0.0)
    if not np.any(good):
        raise _refuse(f"no decaying mode between {BAND[0]:g} and {BAND[1]:g} Hz")
    best = int(np.argmax(np.where(good, amplitude, 0.0)))
    return float(-rates[best].real), float(rates[best].imag)


def _starts(time: FloatArray, values: FloatArray) -> list[tuple[float, float]]:
    """Decay rates [1/s] and frequencies [rad/s] that a matrix pencil finds in the whole stretch and
    in its first parts: of a ring that dies away soon the rest is noise.

    Raises IdentificationError where it finds none in any of them.
    """
    found: list[tuple[float, float]] = []
    for share in (1, 2, 4, 8):
        count = values.size // share
        if count < FEWEST:
            break
        try:
            found.append(pencil_start(time[:count], values[:count]))
        except IdentificationError:
            continue
    if not found:
        raise _refuse(f"no decaying mode between {BAND[0]:g} and {BAND[1]:g} Hz")
    return found


def forced_response(rate: float, omega: float, time: FloatArray, drive: FloatArray) -> FloatArray:
    """Response of the shaft torque, static gain 1, to each column of `drive` (n,) or (n, m).

    `time` (n,) is equidistant. The two-mass shaft passes a torque on the one mass as
    (2σp + ω_n²)/(p² + 2σp + ω_n²).
    """
    step, square = float(time[1] - time[0]), rate**2 + omega**2
    numerator = np.array([2.0 * rate, square])
    denominator = np.array([1.0, 2.0 * rate, square])
    top, bottom, _ = cont2discrete((numerator, denominator), step, method="foh")
    return np.asarray(lfilter(np.ravel(top), bottom, drive, axis=0), dtype=float)


def quiet(torque: Sampled, block: int = 4, still: int = 12) -> Sampled:
    """Engine torque without jitter: where it stands still, a straight line replaces the samples.

    It moves where the means of the `block` values before and after differ by more than four
    standard errors; a run of at least `still` other values is replaced by its regression line.
    """
    v = torque.values
    if v.size < 3 * block or torque.sigma == 0.0:
        return torque
    sums = np.concatenate([[0.0], np.cumsum(v)])
    mean = (sums[block:] - sums[:-block]) / block
    jump = np.abs(mean[block:] - mean[:-block])
    moving = np.zeros(v.size, dtype=bool)
    for k in np.flatnonzero(jump > 4.0 * torque.sigma * np.sqrt(2.0 / block)):
        moving[k : k + 2 * block] = True
    smooth = v.copy()
    edges = np.flatnonzero(np.diff(np.concatenate([[True], moving, [True]]).astype(int)))
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        if last - first >= still:
            t = torque.time[first:last] - torque.time[first]
            smooth[first:last] = np.polyval(np.polyfit(t, v[first:last], 1), t)
    return Sampled(torque.time, smooth, torque.sigma)


def fit_ringdown(
    torque: Sampled,
    lockup: float,
    end: float,
    drive: Drive | None,
    after: float = START_AFTER_LOCKUP,
) -> RingDown:
    """Fit one decaying sine on a quadratic to T_o from `after` [s] past lock-up.

    `drive` adds the response to a moving engine torque, and to that share of its jitter which shows
    in T_o. Amplitudes and share are eliminated (variable projection); the covariance counts noise
    of T_o and unseen torques, as the residual shows them. Raises IdentificationError where no clean
    decay shows, or none that stands out of the noise: the best fit to noise alone has an interval
    too, as narrow as any.
    """
    part = _stretch(torque, lockup, end, after)
    time = np.linspace(part.time[0], part.time[-1], part.time.size)
    values = part.at(time)
    local, trend = time - time[0], _quadratic(time)
    push = _push(drive, time)

    def beside(p: FloatArray) -> FloatArray:
        return np.column_stack([trend, forced_response(p[0], p[1], time, push.jitter)])

    def basis(p: FloatArray) -> FloatArray:
        decay = np.exp(-p[0] * local)
        swing = [decay * np.cos(p[1] * local), decay * np.sin(p[1] * local)]
        return np.column_stack([*swing, beside(p)])

    def unforced(p: FloatArray) -> FloatArray:
        return values - forced_response(p[0], p[1], time, push.sure)

    def projected(p: FloatArray) -> FloatArray:
        return _without(basis(p), unforced(p))

    starts = _starts(time, _without(trend, values - push.sure))
    start = min(starts, key=lambda p: float(np.sum(projected(np.array(p)) ** 2)))
    found = least_squares(projected, start, x_scale=(5.0, 5.0), method="lm")
    rate, omega = (float(v) for v in found.x)
    if not 0.0 < rate < omega < FASTEST * np.pi / (time[1] - time[0]):
        raise _refuse(f"the fit ends at decay rate {rate:.3g} 1/s, {omega / (2 * np.pi):.3g} Hz")
    residual = projected(found.x)
    still = _without(beside(found.x), unforced(found.x))
    noise = _power_near(residual, omega, time[1] - time[0], torque.sigma)
    _require_more_than_chance(float(still @ still - residual @ residual) / noise, time.size)
    slopes, span = np.asarray(found.jac, dtype=float), basis(found.x)
    knots = knots_of(time, omega)
    density = (1.0 - _share(span, unforced(found.x))) * np.interp(knots, time, push.density)
    left = Left(
        residual,
        np.column_stack([span, slopes]),
        torque.sigma,
        forced_response(rate, omega, time, hats(time, knots)),
        density / (knots[1] - knots[0]),
    )
    return RingDown(
        rate,
        omega,
        covariance(left, slopes),
        time,
        values,
        values - residual,
        np.empty(0),
        np.empty(0),
    )


def _share(basis: FloatArray, values: FloatArray) -> float:
    """Share of the jitter, the last column of `basis` where there is any, that shows in `values`.

    Between 0, also without jitter, and 1.
    """
    if basis.shape[1] == SURE:
        return 0.0
    return float(np.clip(np.linalg.lstsq(basis, values, rcond=None)[0][-1], 0.0, 1.0))


def _without(basis: FloatArray, values: FloatArray) -> FloatArray:
    """What the columns of `basis` (n, m) cannot explain of `values` (n,)."""
    q, _ = np.linalg.qr(basis)
    return np.asarray(values - q @ (q.T @ values), dtype=float)


def _require_more_than_chance(explained: float, count: int) -> None:
    """Refuse a sine that explains so few noise variances of `count` samples that noise may do so.

    Of noise one sine with its phase explains χ² of two degrees of freedom, more than x with the
    probability exp(-x/2); about as many sines as there are samples are independent.
    """
    chance = 2.0 * float(np.log(count / CHANCE))
    if explained < chance:
        raise _refuse(
            f"the best decaying sine explains {explained:.3g} times the noise power of a sample, "
            f"and of noise alone it may be {chance:.2g}"
        )


def _power_near(residual: FloatArray, omega: float, step: float, sigma: float) -> float:
    """Noise variance per sample beside a ring at ω: the residual's power from ω/2 to 2ω.

    Never less than the power over all frequencies or the sensor's own noise; these alone where a
    fit has gone to an ω that the samples do not resolve.
    """
    power = np.abs(np.fft.rfft(residual)) ** 2 / residual.size
    frequency = 2.0 * np.pi * np.fft.rfftfreq(residual.size, step)
    near = (frequency > 0.5 * omega) & (frequency < 2.0 * omega)
    there = float(np.mean(power[near])) if near.any() else 0.0
    return max(there, float(np.mean(residual**2)), sigma**2)
