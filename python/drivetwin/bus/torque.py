# SPDX-License-Identifier: MIT
"""Inertias and dead time from the torque message, without a torque meter.

With the clutch open the engine turns alone:

    J_e·dω_e/dt = T(t + d) - T_0

T is the torque on the bus, d its dead time (the message shows it that late) and T_0 what it leaves
out, such as friction beyond the nominal one. In gear i, referred to the output shaft,

    i·T(t + d) = J_g·dω/dt + T_load      J_g = J_v/η + i²·J_e

for engine and vehicle together. The torque also swings the driveline: against the rigid motion the
engine side moves as ∫ e^(-σs)·(cos ωs - σ/ω·sin ωs)·i·T(t - s) ds times a factor, with σ and ω of
the decays. Both balances are integrated once, so that no speed is differentiated, and are linear in
1/J, d/J and T_0/J.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np

from drivetwin._util.arrays import FloatArray, Span
from drivetwin.bus.drift import Swing, build_covariance, fit_noise, solve_weighted, weigh_beside
from drivetwin.bus.recording import Signal, average_neighbours
from drivetwin.bus.scatter import Combined, ShiftValue, combine


@dataclass(frozen=True)
class TorqueSettings:
    """Settings of the balances of torque."""

    edge: float = 0.03
    """Left out at both ends of an open clutch: what rounding and delays leave of its ends [s]."""
    settled: float = 0.1
    """Left out after lock-up [s]."""
    longest: float = 5.0
    """Longest part of a gear with one load [s], as for shifts with a torque meter."""
    min_open: float = 0.15
    """Shortest open clutch [s]."""
    min_held: float = 1.5
    """Shortest gear held [s]: a few periods of the driveline."""
    zero: float = 0.02
    """Standard deviation of T_0 over the largest torque: two steps of a message in percent."""
    oldest: float = 0.1
    """Standard deviation of the dead time before it is measured [s]."""
    fine: float = 2e-3
    """Step of the integration of the swing that a torque causes [s]."""
    samples: int = 160
    """Means into which the samples of a part are gathered [count]: 30 ms of a message of 10 ms."""
    rounds: int = 4
    """Most rounds in which dead time and scale follow the last values [count]."""
    converged: float = 1e-4
    """Step of the dead time at which the rounds end [s]."""


TORQUE = TorqueSettings()


@dataclass(frozen=True, eq=False)
class TorqueSpan:
    """A span of samples at `time` (n,) [s], on the clock of the input speed.

    `speed` (n // width,) [rad/s] are means of `width` samples each. `ratio` times the torque acts:
    1 for the open clutch, i in gear. `swing` is the oscillator of the gear.
    """

    label: str
    gear: str
    time: FloatArray
    speed: FloatArray
    floor: float
    torque: Signal
    ratio: float = 1.0
    swing: Swing | None = None
    width: int = 1

    @cached_property
    def means(self) -> FloatArray:
        """Mean times (n // width,) [s] of the speeds."""
        return average_neighbours(self.time, self.width)


@dataclass(frozen=True, eq=False)
class TorqueBalance:
    """`combined` holds 1/J [1/(kg m^2)], d/J [s/(kg m^2)] and, of the open clutch, -T_0/J."""

    combined: Combined
    ratio: float = 1.0
    attenuation: float = 0.0
    """Largest share by which errors of the impulse between the messages make 1/J smaller (errors
    in variables); the true share is uniform from 0 to this."""

    def compute_inertia(self) -> tuple[float, float]:
        """Inertia [kg m^2] without the mean attenuation, and its standard deviation."""
        mean, std = float(self.combined.value[0]), float(self.combined.std[0])
        relative = float(np.hypot(std / mean, self.attenuation / np.sqrt(12.0)))
        return (1.0 - 0.5 * self.attenuation) / mean, relative / mean

    def compute_dead_time(self) -> tuple[float, float]:
        """Dead time [s] and its standard deviation."""
        slope, mean = float(self.combined.value[1]), float(self.combined.value[0])
        gradient = np.zeros(self.combined.value.size)
        gradient[:2] = -slope / mean**2, 1.0 / mean
        widening = self.combined.std / np.sqrt(np.diag(self.combined.covariance))
        spread = self.combined.covariance * np.outer(widening, widening)
        return slope / mean, float(np.sqrt(gradient @ spread @ gradient))


def select_open(
    label: str, span: Span, engine: Signal, late: float, torque: Signal
) -> TorqueSpan | None:
    """Engine speed in an open clutch; None where it is too short or not recorded."""
    span = (span[0] + TORQUE.edge, span[1] - TORQUE.edge)
    time, values = engine.select((span[0] + late, span[1] + late))
    if time.size < 8 or time[-1] - time[0] < TORQUE.min_open:
        return None
    if not torque.covers((time[0] - late, time[-1] - late)):
        return None
    return TorqueSpan(label, "", time - late, values, engine.floor, torque)


def select_held(
    label: str, gear: str, span: Span, inlet: Signal, ratio: float, swing: Swing, torque: Signal
) -> list[TorqueSpan]:
    """Input speed over ratio in parts of a gear held."""
    span = (
        max(span[0] + TORQUE.settled, float(torque.time[0])),
        min(span[1] - TORQUE.settled, float(torque.time[-1])),
    )
    length = span[1] - span[0]
    if length < TORQUE.min_held:
        return []
    edges = np.linspace(*span, int(np.ceil(length / TORQUE.longest)) + 1).tolist()
    found = []
    for low, high in pairwise(edges):
        time, values = inlet.select((low, high))
        if time.size > 20 and torque.covers((low, high)):
            width = max(1, round(time.size / TORQUE.samples))
            speed, floor = average_neighbours(values, width) / ratio, inlet.floor / ratio
            found.append(TorqueSpan(label, gear, time, speed, floor, torque, ratio, swing, width))
    return found


def balance_open(spans: Sequence[TorqueSpan]) -> TorqueBalance | None:
    """Estimate inertia and dead time of the engine alone, with T_0 the same in all spans."""
    return _balance(spans, with_offset=True)


def balance_held(spans: Sequence[TorqueSpan], late: float | None = None) -> TorqueBalance | None:
    """Estimate inertia in one gear and dead time; the load is each span's own.

    `late` [s] is the dead time to begin with, None to look for it.
    """
    return _balance(spans, late, with_offset=False)


def _balance(
    spans: Sequence[TorqueSpan], late: float | None = None, *, with_offset: bool
) -> TorqueBalance | None:
    if not spans:
        return None
    size = 3 if with_offset else 2
    trials = np.arange(-0.2, 1.21, 0.05) * TORQUE.oldest if late is None else [late]
    tried = [(_pool(spans, float(one), size), float(one)) for one in trials]
    pooled, late = min(tried, key=lambda one: one[0].square)
    scale, share = pooled.scale, pooled.share
    if not scale > 0.0:
        return None
    largest = max(float(np.max(np.abs(one.torque.values))) for one in spans)
    found, wrong = None, 0.0
    for _ in range(TORQUE.rounds):
        # The prior of the dead time is about zero, that of its step about what is left of it.
        prior, centre = np.zeros((size, size)), np.zeros(size)
        prior[1, 1] = 1.0 / (scale * TORQUE.oldest) ** 2
        centre[1] = -late * scale
        if with_offset:
            prior[2, 2] = 1.0 / (scale * TORQUE.zero * largest) ** 2
        fitted = [_fit_span(one, late, size, scale, share) for one in spans]
        values = [one for one, _ in fitted]
        wrong = sum(each for _, each in fitted)
        found = combine(values, prior, centre, fixed=range(1, size))
        if found is None or not found.value[0] > 0.0:
            return None
        scale = float(found.value[0])
        step = float(np.clip(found.value[1] / scale, -TORQUE.oldest, TORQUE.oldest))
        late += step
        if abs(step) < TORQUE.converged:
            break
    if found is None:
        return None
    # Least squares on an impulse with errors finds 1/J smaller by this part.
    smaller = wrong * float(np.diag(found.covariance)[0])
    return TorqueBalance(_shift_dead_time(found, late), spans[0].ratio, smaller)


@dataclass(frozen=True)
class _Pooled:
    """Plain least squares over all spans: sum of squares, 1/J, and the coefficient of the swing
    that the torque causes over 1/J."""

    square: float
    scale: float
    share: float


def _pool(spans: Sequence[TorqueSpan], late: float, size: int) -> _Pooled:
    """Fit all spans with a dead time; T_0, which is small, is left out."""
    rows, targets = [], []
    for one in spans:
        wanted, other = build_columns(one, late, size)
        swings = 0 if one.swing is None else 1
        both = np.column_stack([wanted[:, :1], other[:, other.shape[1] - swings :], one.speed])
        q, _ = np.linalg.qr(other[:, : other.shape[1] - swings])
        left = both - q @ (q.T @ both)
        rows.append(left[:, :-1])
        targets.append(left[:, -1])
    columns, values = np.vstack(rows), np.concatenate(targets)
    found = np.linalg.lstsq(columns, values, rcond=None)[0]
    scale = float(found[0])
    share = float(found[1]) / scale if found.size > 1 and scale != 0.0 else 0.0
    return _Pooled(float(np.sum((values - columns @ found) ** 2)), scale, share)


def _shift_dead_time(found: Combined, late: float) -> Combined:
    """Return the values with the whole dead time in place of its last step."""
    value = found.value.copy()
    value[1] = late * value[0]
    return replace(found, value=value)


def _fit_span(
    one: TorqueSpan, late: float, size: int, scale: float, share: float
) -> tuple[ShiftValue, float]:
    """Coefficients of one span with their information, all others being eliminated, and the part
    of the information on 1/J that errors of the impulse pretend.

    `scale` is 1/J [1/(kg m^2)], by which errors of the torque become such of the speed.
    """
    wanted, other = build_columns(one, late, size, share)
    message, covariance = build_noise(one, late, np.column_stack([wanted, other]), scale)
    weights = weigh_beside(other, covariance)
    value, information = solve_weighted(wanted, one.speed, weights)
    wrong = max(float(np.sum(weights * message)), 0.0) / scale**2
    return ShiftValue(one.label, value, information), wrong


def build_noise(
    one: TorqueSpan, late: float, columns: FloatArray, scale: float
) -> tuple[FloatArray, FloatArray]:
    """Covariances (k, k) of the speed by the torque message alone, and by all noise.

    `columns` (k, p) are those of the mean, `scale` is 1/J [1/(kg m^2)].
    """
    time = one.means - one.means[0]
    basis, strength, _ = np.linalg.svd(
        columns / np.linalg.norm(columns, axis=0), full_matrices=False
    )
    basis = basis[:, strength > 1e-9 * strength[0]]
    message = scale**2 * _build_message_covariance(one, late)
    speed = one.speed - one.speed.mean()
    noise = fit_noise(time, basis, speed, one.floor, one.swing, known=message)
    return message, message + build_covariance(time, noise, one.floor, one.swing)


def _build_message_covariance(one: TorqueSpan, late: float) -> FloatArray:
    """Covariance (n, n) of the impulse [N m s] by what happens between the messages.

    A torque that bends by δ from one message to the next may have stepped by δ at any instant
    between two of them: the impulse of a line then has an error of δ·Δt/√12.
    """
    shown = one.means + late
    first = max(int(np.searchsorted(one.torque.time, shown[0])) - 1, 1)
    last = min(int(np.searchsorted(one.torque.time, shown[-1])) + 1, one.torque.time.size - 2)
    if last <= first:
        return np.zeros((shown.size, shown.size))
    bends = np.abs(np.diff(one.torque.values[first - 1 : last + 2], 2))
    at = one.torque.time[first : last + 1]
    steps = np.diff(at)
    sizes = one.ratio * np.maximum(bends[:-1], bends[1:]) * steps / np.sqrt(12.0)
    passed = np.clip((shown[:, None] - at[:-1]) / steps, 0.0, 1.0)
    return np.asarray((passed * sizes**2) @ passed.T)


def build_columns(
    one: TorqueSpan, late: float, size: int, share: float = 0.0
) -> tuple[FloatArray, FloatArray]:
    """Columns of 1/J, the step of d/J and T_0/J (k, size), and those of no interest (k, m).

    The last of the latter is the swing that the torque causes. It has `share` times the coefficient
    of 1/J, and moves with the dead time too.
    """
    shown = one.time + late
    impulse = one.ratio * integrate_torque(one.torque, shown)
    torque = one.ratio * one.torque.interpolate(shown)
    time = one.time - one.time[0]
    other = [np.ones_like(time)]
    if size == 2:
        other.append(time)
        wanted = [impulse, torque]
    else:
        wanted = [impulse, torque, time]
    if one.swing is not None:
        wanted[1] = torque + share * _differentiate_swing(one, late)
        fall, angle = np.exp(-one.swing.rate * time), one.swing.omega * time
        other += [fall * np.cos(angle), fall * np.sin(angle)]
        response = compute_swing_response(one.time, one.torque, late, one.swing)
        other.append(one.ratio * response)
    both = (np.column_stack(columns) for columns in (wanted, other))
    mean_wanted, mean_other = (average_neighbours(columns, one.width) for columns in both)
    return mean_wanted, mean_other


def _differentiate_swing(one: TorqueSpan, late: float) -> FloatArray:
    """Derivative (n,) by the dead time of the swing that the torque causes, times inertia."""
    assert one.swing is not None
    ahead, behind = (
        compute_swing_response(one.time, one.torque, late + step, one.swing)
        for step in (TORQUE.fine, -TORQUE.fine)
    )
    return np.asarray(one.ratio * (ahead - behind) / (2.0 * TORQUE.fine))


def integrate_torque(torque: Signal, time: FloatArray) -> FloatArray:
    """Integral (n,) [N m s] of a torque that is linear between samples, from `time[0]` on."""
    steps = np.diff(torque.time)
    sums = np.concatenate(
        [[0.0], np.cumsum(0.5 * (torque.values[1:] + torque.values[:-1]) * steps)]
    )
    place = np.clip(np.searchsorted(torque.time, time, side="right") - 1, 0, steps.size - 1)
    ahead = time - torque.time[place]
    slope = np.diff(torque.values)[place] / steps[place]
    total = sums[place] + torque.values[place] * ahead + 0.5 * slope * ahead**2
    return np.asarray(total - total[0])


def compute_swing_response(
    time: FloatArray, torque: Signal, late: float, swing: Swing
) -> FloatArray:
    """Motion (n,) of the engine side against the rigid one that a torque causes, times inertia.

    Exact for a torque that is linear between the points of a fine grid: the complex state
    z' = λ·z + T with λ = -σ + iω is integrated by its exponential (Hochbruck and Ostermann 2010).
    """
    from scipy.signal import lfilter

    grid = np.arange(time[0], time[-1] + TORQUE.fine, TORQUE.fine)
    values = torque.interpolate(grid + late)
    values = values - values[0]
    x = complex(-swing.rate, swing.omega) * TORQUE.fine
    first = (np.exp(x) - 1.0) / x
    second = (np.exp(x) - 1.0 - x) / x**2
    gains = TORQUE.fine * np.array([second, first - second])
    state = lfilter(gains, np.array([1.0, -np.exp(x)]), values.astype(complex))
    moved = state.real - swing.rate / swing.omega * state.imag
    return np.asarray(np.interp(time, grid, moved))
