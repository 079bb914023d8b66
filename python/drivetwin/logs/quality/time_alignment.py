# SPDX-License-Identifier: MIT
"""Delays and clock drift between channels that the driveline couples.

In a gear ω_in = i·ω_out at every instant, so an error in proportion to the acceleration is a
delay. The output torque accelerates the vehicle: J_v·ω' = i_f·T_o - T_v holds at every instant
whatever the gear and the clutches do, so the torque hole of a shift shows its delay. Slow changes
of the load (grade, air) are left out by a band-pass. A warning suggests the mapping line that
corrects a delay; none is applied automatically.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from drivetwin._util.arrays import integrate_trapezoids, remember_for_arrays
from drivetwin.channels.shiftlog import Channel, FloatArray
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.spec import PriorValue

GRID = 0.01
"""Raster [s] on which the speeds are compared."""

SMOOTH = 0.1
"""Averaging [s] before comparison; noise would otherwise hide in the acceleration and bias it."""

IN_GEAR = 0.01
"""Relative distance from a ratio within which its gear is held."""

_LEAST_BLOCK = 0.01
"""Shortest means [s] from which a ratio is estimated; short beside a period of a shaft."""

_BATCHES = 20
"""Parts of a log from whose scatter a standard deviation is estimated [count]."""

_LEAST_TIME = 1.0
"""So much time [s] in gear or clear of gaps is needed for a statement."""

LONGEST = 100.0
"""Points of the raster for each sample at most: beyond that the log is nearly all gap."""

SIGNIFICANT = 5.0
"""Standard deviations from which a delay is reported ..."""

_LEAST_DELAY = 5e-3
"""... if it also exceeds this [s], and by so much half the coarser sample interval."""


@dataclass(frozen=True)
class Delay:
    """Delay [s] of a channel relative to another in the middle of the log.

    `drift` [s/s] is the rate of change of the delay, zero if not estimated; the `sigma`s are one
    standard deviation; `span` [s] of the data in gear.
    """

    value: float
    sigma: float
    drift: float = 0.0
    drift_sigma: float = 0.0
    span: float = 0.0


@dataclass(frozen=True, eq=False)
class Fit:
    """Least-squares solution (p,) and its covariance (p, p)."""

    solution: FloatArray
    covariance: FloatArray


def estimate_speed_delay(faster: Channel, slower: Channel, ratios: Sequence[float]) -> Delay | None:
    """Return how late `slower` is against `faster` where their ratio is one of `ratios`.

    Least squares of ω_f - i·ω_s = δ_g·ω_s + i·(τ + d·t)·dω_s/dt over all samples in gear g: the
    ratio may be off by δ_g, so only changes of acceleration identify the delay. Returns None if
    there is too little time in gear or no such change.
    """
    start = max(faster.time[0], slower.time[0])
    end = min(faster.time[-1], slower.time[-1])
    if not _LEAST_TIME <= end - start <= LONGEST * max(faster.time.size, slower.time.size) * GRID:
        return None
    time = np.arange(start, end, GRID)
    fast, slow = smooth_at_times(faster, time), smooth_at_times(slower, time)
    rate = np.gradient(slow, GRID)
    gear = _classify_gears(fast, slow, ratios, round(SMOOTH / GRID))
    known = (gear >= 0) & np.isfinite(rate) & np.isfinite(fast)
    if np.count_nonzero(known) * GRID < _LEAST_TIME:
        return None
    ratio = np.asarray(ratios)[gear[known]]
    t = time[known] - time[known].mean()
    used = np.unique(gear[known])
    columns = [np.where(gear[known] == one, slow[known], 0.0) for one in used]
    design = np.column_stack([*columns, ratio * rate[known], ratio * rate[known] * t])
    fit = fit_least_squares(design, fast[known] - ratio * slow[known])
    if fit is None:
        return None
    (value, drift), (sigma, drift_sigma) = fit.solution[-2:], np.sqrt(np.diag(fit.covariance))[-2:]
    return Delay(float(value), float(sigma), float(drift), float(drift_sigma), float(np.ptp(t)))


def estimate_speed_ratio(
    faster: Channel, slower: Channel, torque: Channel | None = None
) -> PriorValue | None:
    """Ratio of two speeds that are always geared to each other, with its standard deviation.

    Least squares over means of blocks, whose noise is independent, of
    ω_f = i·ω_s + i·τ·dω_s/dt + dφ/dt with dφ/dt = (dT/dt)/k - c·(d²T/dt²)/k²: neither a delay τ
    between the two nor the twist φ of a shaft between them is an error of the ratio. Without the
    `torque` T of the shaft its twist is part of the residual and widens the standard deviation.
    None where there is too little time, or no motion.
    """
    start, end = max(faster.time[0], slower.time[0]), min(faster.time[-1], slower.time[-1])
    if not _LEAST_TIME <= end - start <= LONGEST * max(faster.time.size, slower.time.size) * GRID:
        return None
    width = max(_LEAST_BLOCK, 2.0 * max(faster.step, slower.step))
    edges = np.arange(start, end, width)
    fast, slow = _compute_block_means(faster, edges), _compute_block_means(slower, edges)
    known = np.isfinite(fast) & np.isfinite(slow)
    if np.count_nonzero(known) * width < _LEAST_TIME:
        return None
    rate = np.gradient(uniform_filter1d(slow, max(1, round(SMOOTH / width))), width)
    columns = [slow, rate]
    if torque is not None:
        twist = np.diff(sample_means(torque, edges)) / width
        columns += [twist, np.gradient(twist, width)]
    design = np.column_stack(columns)
    known &= np.isfinite(design).all(axis=1)
    return _fit_first(design[known], fast[known])


def estimate_final_drive(channels: Mapping[str, Channel]) -> PriorValue | None:
    """Output over wheel speed with its standard deviation; None without both speeds or motion."""
    if "output_speed" not in channels or "wheel_speed" not in channels:
        return None
    torque = channels.get("output_torque")
    return estimate_speed_ratio(channels["output_speed"], channels["wheel_speed"], torque)


def _fit_first(design: FloatArray, target: FloatArray) -> PriorValue | None:
    """Fit `design` (n, p) to `target` (n,); return the first coefficient.

    Its standard deviation is that of sums over `_BATCHES` parts of the log (sandwich estimate):
    what a shaft swings back within a part adds nothing. None where a column is none of its own.
    """
    scale = np.linalg.norm(design, axis=0)
    columns = design[:, scale > 0.0] / scale[scale > 0.0]
    solution, _, rank, _ = np.linalg.lstsq(columns, target, rcond=1e-8)
    count = min(_BATCHES, target.size // 2)
    if scale[0] == 0.0 or rank < columns.shape[1] or count <= rank:
        return None
    residual = target - columns @ solution
    weight = np.linalg.pinv(columns)[0] * residual
    sums = np.array([part.sum() for part in np.array_split(weight, count)])
    std = float(np.sqrt(np.sum(sums**2) * count / (count - rank)))
    return PriorValue(float(solution[0] / scale[0]), std / float(scale[0]))


def _compute_block_means(channel: Channel, edges: FloatArray) -> FloatArray:
    """Means (n - 1,) of a channel between `edges` (n,); NaN where a block touches a gap."""
    total = _integrate(channel.values, channel.time)
    mean = np.diff(np.interp(edges, channel.time, total)) / np.diff(edges)
    inside = channel.covers(edges)
    return np.where(inside[1:] & inside[:-1], mean, np.nan)


_integrate = remember_for_arrays(integrate_trapezoids)
"""Integral of a channel, which several checks need."""


def sample_means(channel: Channel, time: FloatArray) -> FloatArray:
    """Means (n,) of a channel over GRID around each `time` (n,), from all samples there are.

    NaN outside its span and in its gaps.
    """
    start, end = channel.time[0], channel.time[-1]
    edges = np.append(time - 0.5 * GRID, time[-1] + 0.5 * GRID).clip(start, end)
    total = _integrate(channel.values, channel.time)
    sums = np.interp(edges, channel.time, total)
    with np.errstate(invalid="ignore", divide="ignore"):
        mean = np.diff(sums) / np.diff(edges)
    return np.where(channel.covers(time), mean, np.nan)


def smooth_at_times(channel: Channel, time: FloatArray) -> FloatArray:
    """Means (n,) of a channel over SMOOTH around each `time` (n,), which are GRID apart.

    NaN outside its span and where they touch a gap.
    """
    width, values = round(SMOOTH / GRID), sample_means(channel, time)
    unknown = ~np.isfinite(values)
    smooth = uniform_filter1d(np.where(unknown, 0.0, values), width, mode="nearest")
    touched = uniform_filter1d(unknown.astype(np.float64), width, mode="nearest") > 1e-9
    return np.where(touched, np.nan, smooth)


def _classify_gears(
    fast: FloatArray, slow: FloatArray, ratios: Sequence[float], width: int
) -> np.typing.NDArray[np.intp]:
    """Index of the gear held at each sample, -1 for none; clear of the edges of each stretch."""
    with np.errstate(divide="ignore", invalid="ignore"):
        quotient = fast / slow
    gear = np.full(fast.size, -1, np.intp)
    for index, ratio in enumerate(ratios):
        held = np.abs(quotient - ratio) < IN_GEAR * ratio
        gear[uniform_filter1d(held.astype(np.float64), 4 * width, mode="constant") > 0.999] = index
    return gear


def fit_least_squares(design: FloatArray, target: FloatArray) -> Fit | None:
    """Fit `design` (n, p) to `target` (n,), rows GRID apart of signals averaged over SMOOTH.

    None where a column is none of its own.
    """
    scale = np.linalg.norm(design, axis=0)
    if not np.all(scale > 0.0):
        return None
    solution, _, rank, _ = np.linalg.lstsq(design / scale, target, rcond=1e-8)
    if rank < design.shape[1]:
        return None
    residual = target - design / scale @ solution
    independent = max(1.0, target.size * GRID / SMOOTH - design.shape[1])
    covariance = np.linalg.inv((design / scale).T @ (design / scale)) / np.outer(scale, scale)
    return Fit(solution / scale, float(residual @ residual) / independent * covariance)


def check_speed_clocks(channels: Mapping[str, Channel], card: VehicleCard) -> list[Finding]:
    """Return findings on significant delays and drifts of speeds against the input speed."""
    if "input_speed" not in channels:
        return []
    inlet = channels["input_speed"].updates
    findings: list[Finding] = []
    if "output_speed" in channels:
        outlet = channels["output_speed"].updates
        found = estimate_speed_delay(inlet, outlet, [gear.ratio.value for gear in card.gears])
        findings += _check_delay(found, outlet, inlet)
    if "engine_speed" in channels:
        engine = channels["engine_speed"].updates
        found = estimate_speed_delay(engine, inlet, [card.i_in.value])
        turned = None if found is None else replace(found, value=-found.value, drift=-found.drift)
        findings += _check_delay(turned, engine, inlet)
    return findings


def is_significant_delay(delay: Delay, one: Channel, other: Channel) -> bool:
    """Return True if a delay exceeds the effects of noise and sampling of both channels.

    Encoders on a bus may send the mean over a period. Such a sample is half a period late although
    all clocks are right.
    """
    by_sampling = 0.5 * max(one.step, other.step)
    beyond = abs(delay.value) - by_sampling
    return abs(delay.value) > _LEAST_DELAY and beyond > SIGNIFICANT * delay.sigma


def _check_delay(delay: Delay | None, other: Channel, reference: Channel) -> list[Finding]:
    """Report the delay of `other` against `reference`, if it is large and certain enough."""
    if delay is None:
        return []
    least = max(_LEAST_DELAY, 0.5 * other.step, 0.5 * reference.step)
    findings = []
    if is_significant_delay(delay, other, reference):
        amount = Number(delay.value, "s", 1.96 * delay.sigma)
        findings.append(report_delay(Code.CLOCK_LATE, other, amount, reference.source_name))
    if abs(delay.drift) * delay.span > max(least, SIGNIFICANT * delay.drift_sigma * delay.span):
        names = {"other": reference.source_name}
        drift = Number(abs(delay.drift), "s/s")
        findings.append(report(Code.CLOCKS_DRIFT, "", other.place, drift=drift, **names))
    return findings


def report_delay(code: Code, channel: Channel, delay: Number, reference: str) -> Finding:
    """Report a `delay` [s] of a channel relative to others, with the time shift that removes it."""
    return report(
        code,
        "",
        channel.place,
        delay=replace(delay, value=abs(delay.value)),
        side="late" if delay.value > 0.0 else "early",
        reference=reference,
        role=channel.role,
        shift=Number(-delay.value, "s"),
    )


SLOW = 1.0
"""Averaging [s] whose result is taken off both sides: a load that changes slowly goes with it."""

DRIVEN = 10.0
"""The speed must follow the torque by so many standard deviations; brakes and noise hide it."""

ALIKE = 0.5
"""Delays of two speeds are one of the torque if they differ by less, relative to their mean."""

SPEEDS = ("wheel_speed", "output_speed")


def estimate_torque_delay(torque: Channel, speed: Channel) -> Delay | None:
    """Return how late `speed` is against `torque`; None where the log does not show it.

    Least squares of ω = g·(∫T_o dt - τ·T_o) + s·T_o' + d·T_o'' + c, all averaged over SMOOTH less
    the average over SLOW; s and d are twist and damping of a shaft between the two, c a load that
    changes steadily.
    """
    start, end = max(torque.time[0], speed.time[0]), min(torque.time[-1], speed.time[-1])
    if not SLOW < end - start <= LONGEST * max(torque.time.size, speed.time.size) * GRID:
        return None
    time = np.arange(start, end, GRID)
    drive, motion = sample_means(torque, time), sample_means(speed, time)
    unknown = ~(np.isfinite(drive) & np.isfinite(motion))
    clear = (
        uniform_filter1d(unknown.astype(float), _convert_to_width(SLOW), mode="constant", cval=1.0)
        < 1e-9
    )
    if np.count_nonzero(clear) * GRID < _LEAST_TIME:
        return None
    drive, motion = np.where(unknown, 0.0, drive), np.where(unknown, 0.0, motion)
    impulse = GRID * (np.cumsum(drive) - 0.5 * drive)
    rate = np.gradient(drive, GRID)
    terms = (impulse, -drive, rate, np.gradient(rate, GRID))
    columns = [_filter_band(one)[clear] for one in terms]
    design = np.column_stack([*columns, np.ones(columns[0].size)])
    fit = fit_least_squares(design, _filter_band(motion)[clear])
    return None if fit is None else _estimate_delay(fit)


def _convert_to_width(seconds: float) -> int:
    return round(seconds / GRID)


def _filter_band(values: FloatArray) -> FloatArray:
    """Average over SMOOTH less the average over SLOW: straight lines vanish."""
    fast, slow = (uniform_filter1d(values, _convert_to_width(span)) for span in (SMOOTH, SLOW))
    return np.asarray(fast - slow)


def _estimate_delay(fit: Fit) -> Delay | None:
    """τ = (g·τ)/g with its standard deviation; None where the speed does not follow the torque."""
    gain, shifted = fit.solution[:2]
    if not gain > DRIVEN * np.sqrt(fit.covariance[0, 0]):
        return None
    value = float(shifted / gain)
    slope = np.array([-value, 1.0]) / gain
    return Delay(value, float(np.sqrt(slope @ fit.covariance[:2, :2] @ slope)))


def check_torque_delays(channels: Mapping[str, Channel]) -> list[Finding]:
    """Return findings on a significant delay between output torque and speeds.

    A delay against all speeds is attributed to the torque, else to the speed. Only the first sample
    of a repeated value is used.
    """
    if "output_torque" not in channels:
        return []
    torque = channels["output_torque"].updates
    speeds = [channels[role].updates for role in SPEEDS if role in channels]
    found = [(speed, delay) for speed in speeds if (delay := estimate_torque_delay(torque, speed))]
    late = [(speed, one.value) for speed, one in found if is_significant_delay(one, torque, speed)]
    if not late:
        return []
    values = np.array([one.value for _, one in found])
    mean = float(values.mean())
    if np.all(np.abs(values - mean) < ALIKE * abs(mean)):
        names = " and ".join(repr(speed.source_name) for speed, _ in found)
        return [_report_torque_delay(torque, -mean, names, mean < 0.0)]
    return [
        _report_torque_delay(speed, value, repr(torque.source_name), value < 0.0)
        for speed, value in late
    ]


def _report_torque_delay(channel: Channel, value: float, others: str, torque_last: bool) -> Finding:
    """Report a channel that is `value` [s] late; tyre slip too puts a speed before a torque."""
    code = Code.TORQUE_LATE_OR_SLIP if torque_last else Code.TORQUE_CLOCK_LATE
    return report_delay(code, channel, Number(value, "s"), others)
