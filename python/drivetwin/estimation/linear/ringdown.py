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
from scipy.linalg import eigh, expm, solve_banded, svd

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.shifts.coverage import split_at_gaps
from drivetwin.simulation.dual_clutch import compute_series_inertia


@dataclass(frozen=True)
class RingDownSettings:
    """Settings of the ring-down of the output shaft after lock-up."""

    latest_start: float = 0.05
    """Latest start of the fit after lock-up [s]; at 30 Hz most of the power is lost by then."""
    min_length: float = 0.15
    """Shortest fitted span [s]."""
    max_length: float = 1.6
    """Longest fitted span [s]: by then a driveline oscillation has decayed."""
    min_samples: int = 20
    """Fewest fitted samples [count]."""
    band: tuple[float, float] = (2.0, 60.0)
    """Range of the first torsional mode of a driveline [Hz]."""
    max_nyquist_share: float = 0.8
    """Highest estimated frequency over the Nyquist frequency [ratio]."""
    chance: float = 1e-6
    """Probability with which noise alone may pass for an oscillation [probability]. One that just
    passes has a size and decay distorted by noise, hence the small value."""
    knots_per_period: int = 8
    """Knots of an unknown torque in a period of the oscillation [count]."""
    max_knots: int = 200
    """Most knots [count]: as many fill the longest span at 16 Hz; faster ones decay before."""
    min_response: float = 1e-6
    """Smallest response that counts, over the strongest [ratio]."""


RING_DOWN = RingDownSettings()


def compute_shaft_parameters(decay_rate: float, omega_d: float, J4: float, J5: float) -> FloatArray:
    """(k_o [N m/rad], c_o [N m s/rad]) from the oscillation and the inertias it swings between.

    `decay_rate` σ = ζ·ω_n [1/s], `omega_d` [rad/s], so ω_n² = σ² + ω_d². `J4`, `J5` [kg m^2] are
    at the output shaft. Raises IdentificationError unless both inertias are positive.
    """
    if not (J4 > 0.0 and J5 > 0.0):
        raise IdentificationError(
            f"inertias {J4:.4g} and {J5:.4g} kg·m² on the two sides of the output shaft",
            "check the inertia and load fits of this log: both must be positive",
        )
    J = compute_series_inertia(J4, J5)
    return np.array([J * (decay_rate**2 + omega_d**2), 2.0 * decay_rate * J])


TINY = float(np.finfo(float).tiny)


RATIOS = np.logspace(-3.0, 8.0, 45)
"""Power of unknown torques over that of noise, both as the strongest response shows them."""


@dataclass(frozen=True, eq=False)
class FitResidual:
    """Residual of a least-squares fit.

    `residual` (n,) is orthogonal to `explained` (n, p). `sigma` [N m] is the smallest white noise
    of a sample. `response` (n, m) is the response to unit torques at m knots, and `known` (m,) is
    the stated variance of the unmeasured torque there [N²m²].
    """

    residual: FloatArray
    explained: FloatArray
    sigma: float
    response: FloatArray
    known: FloatArray


def place_knots(time: FloatArray, omega: float) -> FloatArray:
    """Knots (m,) [s] between which an unknown torque runs straight, for a ring of ω [rad/s]."""
    span = float(time[-1] - time[0])
    step = max(
        2.0 * np.pi / omega / RING_DOWN.knots_per_period,
        span / RING_DOWN.max_knots,
        span / (time.size - 1),
    )
    return np.linspace(time[0], time[-1], int(span / step + 1e-9) + 1)


def compute_hat_weights(time: FloatArray, knots: FloatArray) -> FloatArray:
    """Weights (n, m) of the knots (m,) in a torque at `time` (n,) that runs straight between."""
    distance = np.abs(time[:, None] - knots) / (knots[1] - knots[0])
    return np.asarray(np.maximum(1.0 - distance, 0.0))


def estimate_variances(left: FitResidual) -> tuple[float, FloatArray]:
    """Variance of the sensor's noise, and of the torque at each knot (m,), as expected of `left`.

    Each ratio of the two powers weighs by its likelihood, all standard deviations of the torque
    being as likely beforehand: the most likely one alone is often zero, and then too little.
    """
    q, _ = np.linalg.qr(left.explained)
    unexplained = left.response - q @ (q.T @ left.response)
    # NumPy's divide and conquer fails for some finite matrices; this driver does not.
    basis, strength, mixture = svd(unexplained, full_matrices=False, lapack_driver="gesvd")
    kept = strength > RING_DOWN.min_response * strength[0]
    basis, seen = basis[:, kept], (strength[:, None] * mixture)[kept]
    shown = basis.T @ left.residual
    rest = max(float(left.residual @ left.residual - shown @ shown), 0.0)
    freedom = left.residual.size - q.shape[1]
    floor = max(
        left.sigma**2, RING_DOWN.min_response * float(np.max(left.known)) * strength[0] ** 2, TINY
    )
    noisy = np.eye(shown.size) + (seen * (left.known / floor)) @ seen.T
    power, modes = eigh(seen @ seen.T, noisy)
    ratios = RATIOS / strength[0] ** 2
    variance = 1.0 + ratios[:, None] * np.maximum(power, 0.0)
    square = np.sum((modes.T @ shown) ** 2 / variance, axis=1) + rest
    noise = np.maximum(square / freedom, floor)
    cost = np.sum(np.log(variance), axis=1) + freedom * np.log(noise) + square / noise
    weight = np.exp(-0.5 * (cost - cost.min())) * np.sqrt(ratios)
    weight /= weight.sum()
    return float(weight @ noise), float(weight @ (ratios * noise)) + left.known


def estimate_slope_covariance(left: FitResidual, slopes: FloatArray) -> FloatArray:
    """Covariance (p, p) of least squares with the residual's derivatives `slopes` (n, p)."""
    noise, torque = estimate_variances(left)
    inverse = np.linalg.inv(slopes.T @ slopes)
    acting = inverse @ (slopes.T @ left.response)
    return np.asarray(noise * inverse + (acting * torque) @ acting.T)


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

    torque: MeasuredSignal
    gain: float


@dataclass(frozen=True, eq=False)
class _Push:
    """Contribution of the engine torque to T_o of a stiff shaft [N m], at the fitted instants (n,).

    `sure` is that contribution without jitter, less its first value. `jitter` is (n, 1), or (n, 0)
    without jitter. `density` [N²m²s] is the power density of the noise that remains in `sure` if
    the jitter is sensor noise.
    """

    sure: FloatArray
    jitter: FloatArray
    density: FloatArray


def _compute_push(drive: Drive | None, time: FloatArray) -> _Push:
    if drive is None:
        return _Push(np.zeros_like(time), np.empty((time.size, 0)), np.zeros_like(time))
    measured, calm = drive.torque, remove_jitter(drive.torque)
    sure = drive.gain * calm.interpolate_at_times(time)
    jitter = drive.gain * measured.interpolate_at_times(time) - sure
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


def _select_ring_samples(
    torque: MeasuredSignal, lockup: float, end: float, after: float
) -> MeasuredSignal:
    span = (lockup + after, min(end, lockup + RING_DOWN.max_length))
    for whole in split_at_gaps(span, torque.gaps):
        part = torque.select_span(whole)
        if (
            part.time.size >= RING_DOWN.min_samples
            and part.time[-1] - part.time[0] >= RING_DOWN.min_length
        ):
            return part
    raise _refuse(f"less than {RING_DOWN.min_length:g} s of the new gear are left after lock-up")


def _build_quadratic(time: FloatArray) -> FloatArray:
    u = (time - time[0]) / (time[-1] - time[0])
    return np.column_stack([np.ones_like(u), u, u * u])


def estimate_pencil_start(
    time: FloatArray, values: FloatArray, order: int = 6
) -> tuple[float, float]:
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
    good = (frequency > RING_DOWN.band[0]) & (frequency < RING_DOWN.band[1]) & (rates.real < 0.0)
    if not np.any(good):
        raise _refuse("no decaying mode between {:g} and {:g} Hz".format(*RING_DOWN.band))
    best = int(np.argmax(np.where(good, amplitude, 0.0)))
    return float(-rates[best].real), float(rates[best].imag)


def _list_pencil_starts(time: FloatArray, values: FloatArray) -> list[tuple[float, float]]:
    """Decay rates [1/s] and frequencies [rad/s] that a matrix pencil finds in the whole stretch and
    in its first parts: of a ring that dies away soon the rest is noise.

    Raises IdentificationError where it finds none in any of them.
    """
    found: list[tuple[float, float]] = []
    for share in (1, 2, 4, 8):
        count = values.size // share
        if count < RING_DOWN.min_samples:
            break
        try:
            found.append(estimate_pencil_start(time[:count], values[:count]))
        except IdentificationError:
            continue
    if not found:
        raise _refuse("no decaying mode between {:g} and {:g} Hz".format(*RING_DOWN.band))
    return found


def compute_forced_response(
    rate: float, omega: float, time: FloatArray, drive: FloatArray
) -> FloatArray:
    """Response of the shaft torque, static gain 1, to each column of `drive` (n,) or (n, m).

    `time` (n,) is equidistant. The two-mass shaft passes a torque on the one mass as
    (2σp + ω_n²)/(p² + 2σp + ω_n²).
    """
    step, square = float(time[1] - time[0]), rate**2 + omega**2
    system = np.array([[0.0, 1.0], [-square, -2.0 * rate]])
    seen = np.array([square, 2.0 * rate])
    # Exact for a torque that is linear between samples: transition with ramp input (Van Loan 1978).
    augmented = np.zeros((4, 4))
    augmented[:2, :2] = step * system
    augmented[1, 2], augmented[2, 3] = step, 1.0
    moved = expm(augmented)
    transition, level, ramp = moved[:2, :2], moved[:2, 2], moved[:2, 3]
    push = level + transition @ ramp - ramp
    trace, determinant, direct = float(np.trace(transition)), np.linalg.det(transition), seen @ ramp
    top = (
        direct,
        seen @ push - direct * trace,
        direct * determinant + seen @ (transition @ push - trace * push),
    )
    forced = top[0] * drive
    forced[1:] += top[1] * drive[:-1]
    forced[2:] += top[2] * drive[:-2]
    bands = np.ones((3, drive.shape[0]))
    bands[1], bands[2] = -trace, determinant
    return np.asarray(solve_banded((2, 0), bands, forced), dtype=float)


def remove_jitter(torque: MeasuredSignal, block: int = 4, still: int = 12) -> MeasuredSignal:
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
    return MeasuredSignal(torque.time, smooth, torque.sigma)


def fit_ringdown(
    torque: MeasuredSignal,
    lockup: float,
    end: float,
    drive: Drive | None,
    after: float = RING_DOWN.latest_start,
) -> RingDown:
    """Fit one decaying sine on a quadratic to T_o from `after` [s] past lock-up.

    `drive` adds the response to a moving engine torque, and to that share of its jitter which shows
    in T_o. Amplitudes and share are eliminated (variable projection); the covariance counts noise
    of T_o and unseen torques, as the residual shows them. Raises IdentificationError where no clean
    decay shows, or none that stands out of the noise: the best fit to noise alone has an interval
    too, as narrow as any.
    """
    from scipy.optimize import least_squares

    part = _select_ring_samples(torque, lockup, end, after)
    time = np.linspace(part.time[0], part.time[-1], part.time.size)
    values = part.interpolate_at_times(time)
    local, trend = time - time[0], _build_quadratic(time)
    push = _compute_push(drive, time)

    def beside(p: FloatArray) -> FloatArray:
        return np.column_stack([trend, compute_forced_response(p[0], p[1], time, push.jitter)])

    def basis(p: FloatArray) -> FloatArray:
        decay = np.exp(-p[0] * local)
        swing = [decay * np.cos(p[1] * local), decay * np.sin(p[1] * local)]
        return np.column_stack([*swing, beside(p)])

    def unforced(p: FloatArray) -> FloatArray:
        return values - compute_forced_response(p[0], p[1], time, push.sure)

    def projected(p: FloatArray) -> FloatArray:
        return _remove_explained(basis(p), unforced(p))

    starts = _list_pencil_starts(time, _remove_explained(trend, values - push.sure))
    start = min(starts, key=lambda p: float(np.sum(projected(np.array(p)) ** 2)))
    found = least_squares(projected, start, x_scale=(5.0, 5.0), method="lm")
    rate, omega = (float(v) for v in found.x)
    if not 0.0 < rate < omega < RING_DOWN.max_nyquist_share * np.pi / (time[1] - time[0]):
        raise _refuse(f"the fit ends at decay rate {rate:.3g} 1/s, {omega / (2 * np.pi):.3g} Hz")
    residual = projected(found.x)
    still = _remove_explained(beside(found.x), unforced(found.x))
    noise = _estimate_adjacent_power(residual, omega, time[1] - time[0], torque.sigma)
    _require_more_than_chance(float(still @ still - residual @ residual) / noise, time.size)
    slopes, span = np.asarray(found.jac, dtype=float), basis(found.x)
    knots = place_knots(time, omega)
    density = (1.0 - _estimate_jitter_share(span, unforced(found.x))) * np.interp(
        knots, time, push.density
    )
    left = FitResidual(
        residual,
        np.column_stack([span, slopes]),
        torque.sigma,
        compute_forced_response(rate, omega, time, compute_hat_weights(time, knots)),
        density / (knots[1] - knots[0]),
    )
    return RingDown(
        rate,
        omega,
        estimate_slope_covariance(left, slopes),
        time,
        values,
        values - residual,
        np.empty(0),
        np.empty(0),
    )


def _estimate_jitter_share(basis: FloatArray, values: FloatArray) -> float:
    """Share of the jitter, the last column of `basis` where there is any, that shows in `values`.

    Between 0, also without jitter, and 1.
    """
    if basis.shape[1] == SURE:
        return 0.0
    return float(np.clip(np.linalg.lstsq(basis, values, rcond=None)[0][-1], 0.0, 1.0))


def _remove_explained(basis: FloatArray, values: FloatArray) -> FloatArray:
    """Residual of `values` (n,) after projection on the columns of `basis` (n, m)."""
    q, _ = np.linalg.qr(basis)
    return np.asarray(values - q @ (q.T @ values), dtype=float)


def _require_more_than_chance(explained: float, count: int) -> None:
    """Refuse a sine that explains so few noise variances of `count` samples that noise may do so.

    Of noise one sine with its phase explains χ² of two degrees of freedom, more than x with the
    probability exp(-x/2); about as many sines as there are samples are independent.
    """
    chance = 2.0 * float(np.log(count / RING_DOWN.chance))
    if explained < chance:
        raise _refuse(
            f"the best decaying sine explains {explained:.3g} times the noise power of a sample, "
            f"and of noise alone it may be {chance:.2g}"
        )


def _estimate_adjacent_power(
    residual: FloatArray, omega: float, step: float, sigma: float
) -> float:
    """Noise variance per sample beside a ring at ω: the residual's power from ω/2 to 2ω.

    Never less than the power over all frequencies or the sensor's own noise; these alone where a
    fit has gone to an ω that the samples do not resolve.
    """
    power = np.abs(np.fft.rfft(residual)) ** 2 / residual.size
    frequency = 2.0 * np.pi * np.fft.rfftfreq(residual.size, step)
    near = (frequency > 0.5 * omega) & (frequency < 2.0 * omega)
    there = float(np.mean(power[near])) if near.any() else 0.0
    return max(there, float(np.mean(residual**2)), sigma**2)
