# SPDX-License-Identifier: MIT
"""Least-squares fit of piecewise polynomials with evenly spaced knots to a record."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from drivetwin._util.arrays import FloatArray

_WHOLE = 0.01
"""Part of a sample by which a period may differ from a whole number and count as one."""
_PHASES = 24
"""Instants within a period at which the search for the knots begins [count]."""
_SHORT = 2048
"""Samples from which start and period are refined [count]."""
_FEW = 5
"""Instants within a period at which a cubic interpolant is tried [count]."""
_CONTRAST = 0.9
"""Least misfit of these relative to the largest that suggests knots."""
_ENDS = 4
"""Periods at each end where an interpolant depends on samples outside the record [count]."""
ROUND_OFF = 1e-12
"""Differences over the largest value that are round-off of an interpolation."""
_BLOCKS = 32
"""Parts of a record that are compared one by one [count]."""
_LEAST_BLOCKS = 8
"""Parts that must bend [count]: some corners of a straight record make no raster."""
_LEAST_SHARE = 1e-3
"""Misfit of a part over the largest from which it counts as bent: a spline carries that of a corner
on into the parts beside."""


class Interpolant(StrEnum):
    """Piecewise polynomials that tools fill up with."""

    LINEAR = "linear"
    SPLINE = "spline"  # cubic, second derivative continuous
    PCHIP = "pchip"
    MAKIMA = "makima"
    HERMITE = "hermite"  # any cubic with a continuous slope


@dataclass(frozen=True, eq=False)
class KnotFit:
    """Knots at `start` + k·`period` [s], the record's `values` (m,) there, and misfits.

    `misfit` is the root mean square of record minus interpolant, `misfit_between` the same with
    knots half a period later, and `contrast` the median of their ratio over parts of the record:
    a few steps of a smooth signal that fall on knots leave it near one. `on_grid` where each knot
    is a sample of the record.
    """

    start: float
    period: float
    interpolant: Interpolant
    values: FloatArray
    misfit: float
    misfit_between: float
    contrast: float
    on_grid: bool


@dataclass(frozen=True, eq=False)
class _Misfit:
    """Record minus interpolant `left` (n,), NaN where none is counted; root mean square `size`."""

    left: FloatArray
    size: float

    def compare(self, other: _Misfit, values: FloatArray) -> float:
        """Return the median ratio of misfits over parts of the record, this one to `other`.

        Parts that both reproduce, as straight ones, are no evidence; without evidence the ratio is
        one.
        """
        ours, theirs = (
            np.array([_compute_rms(part) for part in np.array_split(one.left, _BLOCKS)])
            for one in (self, other)
        )
        least = max(ROUND_OFF * float(np.abs(values).max()), _LEAST_SHARE * float(theirs.max()))
        bent = theirs > least
        enough = np.count_nonzero(bent) >= _LEAST_BLOCKS
        return float(np.median(ours[bent] / theirs[bent])) if enough else 1.0


def _compute_rms(values: FloatArray) -> float:
    """Compute the root mean square of the finite `values`; 0 without any."""
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else 0.0


def fit_on_grid(
    time: FloatArray, values: FloatArray, period: float, interpolant: Interpolant
) -> KnotFit | None:
    """Fit knots that are samples of an evenly sampled record, about every `period` [s].

    Parameters
    ----------
    time, values : FloatArray, shape (n,)
        Evenly sampled record [s].
    period : float
        Approximate distance of knots [s].
    interpolant : Interpolant
        Polynomial between knots.

    Returns
    -------
    KnotFit or None
        None where the period is no whole number of samples, or the interpolant has as many
        unknowns as the record has samples.
    """
    step = float(time[-1] - time[0]) / (time.size - 1)
    samples = round(period / step)
    if abs(period / step - samples) > _WHOLE or samples < 2:
        return None
    if interpolant is Interpolant.HERMITE and samples < 4:
        return None
    # A cubic one shows where the knots are also by lines, which are fast.
    lines = [
        _compute_grid_misfit(values, first, samples, Interpolant.LINEAR).size
        for first in range(samples)
    ]
    firsts = np.argsort(lines)[: samples if samples < _FEW else _FEW]
    misfits = {int(k): _compute_grid_misfit(values, int(k), samples, interpolant) for k in firsts}
    first = min(misfits, key=lambda one: misfits[one].size)
    between = _compute_grid_misfit(values, (first + samples // 2) % samples, samples, interpolant)
    return KnotFit(
        start=float(time[first]),
        period=samples * step,
        interpolant=interpolant,
        values=values[first::samples],
        misfit=misfits[first].size,
        misfit_between=between.size,
        contrast=misfits[first].compare(between, values),
        on_grid=True,
    )


def _compute_grid_misfit(
    values: FloatArray, first: int, samples: int, interpolant: Interpolant
) -> _Misfit:
    """Compare every `samples`-th value, interpolated, with the rest of the record."""
    index = np.arange(values.size, dtype=float)
    if interpolant is Interpolant.HERMITE:
        knots = index[first::samples]
        return _fit_spline(index, values, knots, interpolant)[1]
    at = index[first::samples]
    low, high = int(at[min(_ENDS, at.size // 4)]), int(at[-1 - min(_ENDS, at.size // 4)])
    inner = index[low:high]
    between = (inner - first) % samples != 0
    modelled = _make_interpolant(at, values[first::samples], interpolant)(inner)
    left = np.full(values.size, np.nan)
    left[low:high][between] = (values[low:high] - modelled)[between]
    return _Misfit(left, float(np.sqrt(np.nanmean(left**2))))


def _make_interpolant(
    at: FloatArray, values: FloatArray, interpolant: Interpolant
) -> Callable[[FloatArray], FloatArray]:
    if interpolant is Interpolant.LINEAR:
        return lambda x: np.interp(x, at, values)
    from scipy.interpolate import Akima1DInterpolator, CubicSpline, PchipInterpolator

    if interpolant is Interpolant.SPLINE:
        return CubicSpline(at, values)
    # Slopes of numbers next to zero overflow on the way to a slope of zero.
    with np.errstate(all="ignore"):
        if interpolant is Interpolant.PCHIP:
            return PchipInterpolator(at, values)
        return Akima1DInterpolator(at, values, method="makima")


def fit_off_grid(
    time: FloatArray, values: FloatArray, period: float, interpolant: Interpolant
) -> KnotFit | None:
    """Fit knots between the samples of a record, about every `period` [s]; see `fit_on_grid`."""
    if interpolant in (Interpolant.PCHIP, Interpolant.MAKIMA):
        return None  # of the space of HERMITE
    step = float(time[-1] - time[0]) / (time.size - 1)
    if period < (2.4 if interpolant is Interpolant.HERMITE else 1.5) * step:
        return None
    raster = refine_raster(time, values, (float(time[0]), period), interpolant)
    if raster is None:
        return None
    start, period = raster
    knots = place_knots(time, start, period)
    if knots.size < 2 * _ENDS:
        return None
    heights, misfit = _fit_spline(time, values, knots, interpolant)
    _, between = _fit_spline(time, values, knots + 0.5 * period, interpolant)
    return KnotFit(
        start=start,
        period=period,
        interpolant=interpolant,
        values=heights,
        misfit=misfit.size,
        misfit_between=between.size,
        contrast=misfit.compare(between, values),
        on_grid=False,
    )


def place_knots(time: FloatArray, start: float, period: float) -> FloatArray:
    """Return the instants `start` + k·`period` [s] within a record."""
    first = np.ceil((time[0] - start) / period - 1e-6)
    last = np.floor((time[-1] - start) / period + 1e-6)
    return np.asarray(start + period * np.arange(first, last + 1.0))


def refine_raster(
    time: FloatArray, values: FloatArray, raster: tuple[float, float], interpolant: Interpolant
) -> tuple[float, float] | None:
    """Search start and period [s] of knots near `raster` with the least misfit.

    None where the misfit hardly depends on the start.
    """
    from scipy.optimize import minimize

    start, period = raster
    short = slice(0, _SHORT // 2)

    def compute_misfit(start: float, period: float, part: slice) -> float:
        knots = place_knots(time[part], start, period)
        if knots.size < 2 * _ENDS:
            return np.inf
        return _fit_spline(time[part], values[part], knots, interpolant)[1].size

    starts = start + period * np.arange(_PHASES) / _PHASES
    misfits = [compute_misfit(one, period, short) for one in starts]
    if not min(misfits) < _CONTRAST * max(misfits):
        return None
    start = float(starts[int(np.argmin(misfits))])
    parts = (slice(0, _SHORT // 4), slice(None))
    for part in parts[time.size <= _SHORT // 4 :]:
        length = float(time[part][-1] - time[part][0])
        scale = np.array([0.03 * period, 0.1 * period**2 / length])
        middle = np.array([start + period * round((0.5 * length) / period), period])

        def compute(x: FloatArray, middle: FloatArray, scale: FloatArray, part: slice) -> float:
            at, apart = middle + x * scale
            return compute_misfit(float(at), float(apart), part)

        found = minimize(
            compute,
            np.zeros(2),
            (middle, scale, part),
            method="Nelder-Mead",
            options={"initial_simplex": [[0, 0], [1, 0], [0, 1]], "maxfev": 70, "xatol": 1e-5},
        )
        start, period = middle + found.x * scale
    return float(start), float(period)


def _fit_spline(
    time: FloatArray, values: FloatArray, knots: FloatArray, interpolant: Interpolant
) -> tuple[FloatArray, _Misfit]:
    """Fit a spline with these knots; return its values there and the misfit per freedom."""
    from scipy.interpolate import make_lsq_spline

    none = _Misfit(np.full(time.size, np.nan), np.inf)
    inside = (time >= knots[0]) & (time <= knots[-1])
    x, y = time[inside], values[inside]
    order = 1 if interpolant is Interpolant.LINEAR else 3
    inner = np.repeat(knots[1:-1], 2 if interpolant is Interpolant.HERMITE else 1)
    grid = np.concatenate(([x[0]] * (order + 1), inner, [x[-1]] * (order + 1)))
    try:
        spline = make_lsq_spline(x, y, grid, order)
    except (ValueError, np.linalg.LinAlgError):  # a piece without samples
        return np.empty(0), none
    freedom = x.size - (grid.size - order - 1)
    if freedom < 0.1 * x.size:
        return np.empty(0), none
    left = y - spline(x)
    edge = _ENDS * max(int(x.size / knots.size), 1)
    if left.size > 4 * edge:
        left[:edge] = left[-edge:] = np.nan
    left *= np.sqrt(x.size / freedom)
    whole = none.left
    whole[inside] = left
    heights = np.asarray(spline(np.clip(knots, x[0], x[-1])))
    return heights, _Misfit(whole, float(np.sqrt(np.nanmean(left**2))))


def extend_knots(
    time: FloatArray, values: FloatArray, fit: KnotFit
) -> tuple[FloatArray, FloatArray]:
    """Return instants [s] (m,) and values (m,) of the knots of a whole record.

    From the window of `fit` the raster is followed both ways, as the clocks of sender and logger
    drift apart. Stretches without enough samples have no knots; both are empty where all are such.
    """
    reach = _ENDS * fit.period
    length = max(_SHORT * float(np.median(np.diff(time))), 4.0 * reach)
    count = max(int((time[-1] - time[0]) / length), 1)
    borders = np.linspace(time[0], time[-1], count + 1)
    borders[-1] = np.inf
    middle = int(np.searchsorted(borders, fit.start, side="right")) - 1
    found: dict[int, tuple[FloatArray, FloatArray]] = {}
    for way in (range(middle, count), range(middle - 1, -1, -1)):
        start = fit.start
        for k in way:
            low, high = borders[k], borders[k + 1]
            part = slice(*np.searchsorted(time, (low - reach, high + reach)))
            if part.stop - part.start < _ENDS:
                continue
            start = _follow_start(time[part], values[part], start, fit)
            knots = place_knots(time[part], start, fit.period)
            if knots.size < 2 * _ENDS:
                continue
            heights, _ = _fit_spline(time[part], values[part], knots, fit.interpolant)
            inner = (knots >= low) & (knots < high)
            if heights.size:
                found[k] = knots[inner], heights[inner]
    parts = [found[k] for k in sorted(found)] or [(np.empty(0), np.empty(0))]
    return np.concatenate([at for at, _ in parts]), np.concatenate([one for _, one in parts])


def _follow_start(time: FloatArray, values: FloatArray, start: float, fit: KnotFit) -> float:
    """Return the instant of a knot near which the raster `start` + k·period fits best."""
    from scipy.optimize import minimize_scalar

    base = start + fit.period * np.round((time[0] - start) / fit.period)

    def compute_misfit(late: float) -> float:
        knots = place_knots(time, base + late, fit.period)
        if knots.size < 2 * _ENDS:
            return 0.0
        return _fit_spline(time, values, knots, fit.interpolant)[1].size

    reach = 0.1 * fit.period
    found = minimize_scalar(
        compute_misfit, bounds=(-reach, reach), method="bounded", options={"xatol": 1e-5 * reach}
    )
    better = found.fun < (1.0 - 1e-3) * compute_misfit(0.0)
    return float(base + (found.x if better else 0.0))
