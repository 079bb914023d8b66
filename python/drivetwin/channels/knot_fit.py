# SPDX-License-Identifier: MIT
"""Least-squares fit of piecewise polynomials with knots on a regular raster, and its evidence."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from drivetwin._util.arrays import FloatArray

MIN_KNOTS = 16
"""Fewest knots that can show a raster [count]: each has a chance of a half."""
_ROWS = 2048
"""Rows that knots are fitted to [count]: cost of work."""
_PHASES = 24
"""Instants within a period at which the search for knots between rows begins [count]."""
_WHOLE = 0.01
"""Part of a row by which a period may differ from a whole number: the spectrum shows no more."""
_ENDS = 4
"""Periods at each end where an interpolant depends on samples outside the record [count]."""
_PARTS = 32
"""Parts of a record that are compared one by one [count]."""
_FEW_ROWS = 5
"""Rows between knots from which on rows show any cubic: four unknowns each [count]."""
_KNOT_ROUNDING = 1.3
"""Largest variance of an interpolated number for that of its rounded knots."""
_SEARCHED = 1e-4
"""Misfit over that half a period away which the search for the instants of knots may leave."""
_ROUND_OFF = 1e-12
"""Misfit over the largest value that is round-off of an interpolation."""
_BEND, _BEND_SQUARES = 5, 70.0
"""Rows of a fourth difference, which is 0 on a cubic, and the sum of its squared weights."""
_FREE = 0.1
"""Least share of rows beyond the unknowns of a fit."""


class Interpolant(StrEnum):
    """Piecewise polynomials that tools fill up with."""

    LINEAR = "linear"
    SPLINE = "spline"  # cubic, second derivative continuous
    HERMITE = "hermite"  # any cubic with a continuous slope
    PCHIP = "pchip"
    MAKIMA = "makima"

    @property
    def has_formula(self) -> bool:
        """True if the values at the knots determine the polynomial."""
        return self is not Interpolant.HERMITE


_FITTED = (Interpolant.LINEAR, Interpolant.SPLINE, Interpolant.HERMITE)


@dataclass(frozen=True, eq=False)
class KnotRaster:
    """Knots at `start` + k·`period` [s], at rows of the record where `on_rows`."""

    start: float
    period: float
    interpolant: Interpolant
    on_rows: bool

    @property
    def is_linear(self) -> bool:
        """True if straight lines join the knots."""
        return self.interpolant is Interpolant.LINEAR

    def place_knots(self, time: FloatArray, share: float = 0.0, parts: int = 1) -> FloatArray:
        """Return the knots [s] (m,) within a record, later by a `share` of the period.

        With `parts` there are so many per period.
        """
        start, period = self.start + share * self.period, self.period / parts
        first = np.ceil((time[0] - start) / period - 1e-6)
        last = np.floor((time[-1] - start) / period + 1e-6)
        return np.asarray(start + period * np.arange(first, last + 1.0))


def find_raster_of_knots(
    time: FloatArray,
    values: FloatArray,
    periods: Sequence[float],
    resolution: float,
    prior: float,
) -> KnotRaster | None:
    """Find the raster of knots of an evenly sampled record.

    Parameters
    ----------
    time, values : FloatArray, shape (n,)
        Record [s].
    periods : Sequence of float
        Periods to try [s], longest first.
    resolution : float
        Step that the values are rounded to.
    prior : float
        Logarithm of the odds that the evidence must exceed.

    Returns
    -------
    KnotRaster or None
        None where no raster explains the record better than chance.
    """
    step = float(time[-1] - time[0]) / (time.size - 1)
    for period in _list_possible(values, periods, step, resolution):
        rows = int(max(_ROWS, 2 * _PARTS * period / step))
        first = max((time.size - rows) // 2, 0)
        part = slice(first, first + rows)
        passed = [
            raster
            for raster, tried in _list_rasters(time[part], values[part], period, step)
            if _weigh_raster(time[part], values[part], raster, resolution)
            > prior + np.log(tried * len(periods))
        ]
        if passed:
            return min(passed, key=lambda one: fit_knots(time[part], values[part], one).size)
    return None


def _list_possible(
    values: FloatArray, periods: Sequence[float], step: float, resolution: float
) -> list[float]:
    """List the periods whose pieces, of a cubic each, may lie under the roughness of a record.

    The fourth difference of rows within a piece is that of their errors. So many runs of rows do
    not pass a knot; half of them are below the root mean square.
    """
    error = max(_round_knots(resolution), _SEARCHED * float(np.std(values)))
    bends = np.abs(np.diff(values, _BEND - 1))
    within = np.array([max(1.0 - (_BEND - 1) * step / period, 0.0) for period in periods])
    smooth = np.quantile(bends, 0.5 * within) < np.sqrt(_BEND_SQUARES) * error
    return [one for one, can in zip(periods, smooth | (within <= 0.0), strict=True) if can]


def _round_knots(resolution: float) -> float:
    """Return the root mean square of the rounding of rows and of knots."""
    return float(np.sqrt((1.0 + _KNOT_ROUNDING) / 12.0) * resolution)


def _list_rasters(
    time: FloatArray, values: FloatArray, period: float, step: float
) -> Iterator[tuple[KnotRaster, int]]:
    """List the best raster of each interpolant near a `period`, and how many were tried.

    Few rows between the knots do not show any cubic, but one by a formula.
    """
    rows = round(period / step)
    if abs(period / step - rows) < _WHOLE * rows and rows > 1:
        few = rows < _FEW_ROWS
        for interpolant in (one for one in Interpolant if not few or one.has_formula):
            rasters = [KnotRaster(float(t), rows * step, interpolant, True) for t in time[:rows]]
            # A cubic one shows where the knots are also by lines, which are fast.
            rasters.sort(key=lambda one: _fit_lines(time, values, one, step))
            yield _choose_raster(time, values, rasters[:_FEW_ROWS]), rows
    short = slice(0, time.size // 2)
    for interpolant in _FITTED if period > 2.0 * step else ():
        starts = time[0] + period * np.arange(_PHASES) / _PHASES
        rasters = [KnotRaster(float(one), period, interpolant, False) for one in starts]
        raster = _choose_raster(time[short], values[short], rasters)
        chance = float(np.log(_PHASES))
        if _weigh_start(*_measure_parts(time[short], values[short], raster)) > chance:
            yield _refine_raster(time, values, raster), _PHASES


def _choose_raster(
    time: FloatArray, values: FloatArray, rasters: Sequence[KnotRaster]
) -> KnotRaster:
    """Return the raster with the least misfit."""
    return min(rasters, key=lambda one: fit_knots(time, values, one).size)


def _fit_lines(time: FloatArray, values: FloatArray, raster: KnotRaster, step: float) -> float:
    """Return the misfit of straight lines between the rows of a raster."""
    first, rows = round((raster.start - time[0]) / step), round(raster.period / step)
    at = np.arange(first, values.size, rows)
    inner = np.arange(at[0], at[-1])
    return _compute_rms(values[inner] - np.interp(inner, at, values[at]))


@dataclass(frozen=True, eq=False)
class KnotFit:
    """Values (m,) of a record at its knots, and record minus interpolant `left` (n,).

    That is NaN at the ends, and scaled to the deviation of the record; `size` is its root mean
    square, infinite where there are as many unknowns as rows.
    """

    heights: FloatArray
    left: FloatArray

    @property
    def size(self) -> float:
        """Root mean square of what is left."""
        return _compute_rms(self.left)

    def list_sizes(self) -> FloatArray:
        """Return the root mean square of each part of the record."""
        return np.array([_compute_rms(part) for part in np.array_split(self.left, _PARTS)])


def _compute_rms(values: FloatArray) -> float:
    """Compute the root mean square of the numbers in `values`; infinite without any."""
    finite = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(finite**2))) if finite.size else np.inf


def _weigh_raster(
    time: FloatArray, values: FloatArray, raster: KnotRaster, resolution: float
) -> float:
    """Return the evidence of a raster in a record.

    0 if it leaves more than rounding does, or if rounding explains what one half a period away
    leaves. Without a filling each part of the record prefers either by chance. If a finer
    interpolant explains more of most parts, the knots are not the samples.
    """
    mine, other = _measure_parts(time, values, raster)
    rounding = _round_knots(resolution)
    usual = float(np.nanmedian(other))
    if not np.nanmedian(mine) < max(rounding, _SEARCHED * usual) < usual:
        return 0.0
    if raster.interpolant in _FITTED:
        finer = [fit_knots(time, values, raster, parts=parts) for parts in (3, 2)]
        known = mine
    else:
        finer = [fit_knots(time, values, replace(raster, interpolant=Interpolant.HERMITE))]
        known = mine / np.sqrt(1.0 + _KNOT_ROUNDING)
    more = next((one for one in finer if one.heights.size), finer[0]).list_sizes()
    counted = np.isfinite(mine) & np.isfinite(more)
    if not counted.any() and raster.period > 2.5 * float(time[1] - time[0]):
        return 0.0
    against = int(np.count_nonzero(more[counted] < known[counted]))
    return _weigh_start(mine, other) - _measure_odds(against, int(np.count_nonzero(counted)))


def _measure_parts(
    time: FloatArray, values: FloatArray, raster: KnotRaster
) -> tuple[FloatArray, FloatArray]:
    """Return the misfit of each part of a record with a raster, and with one half a period later.

    Both are at least the round-off.
    """
    round_off = _ROUND_OFF * float(np.abs(values).max())
    both = (fit_knots(time, values, raster, share=share).list_sizes() for share in (0.0, 0.5))
    mine, other = (np.maximum(one, round_off) for one in both)
    return mine, other


def _weigh_start(mine: FloatArray, other: FloatArray) -> float:
    """Return the evidence of misfits (m,) against `other` ones (m,) where they differ."""
    counted = np.isfinite(mine) & np.isfinite(other) & (mine != other)
    better = int(np.count_nonzero(mine[counted] < other[counted]))
    return _measure_odds(better, int(np.count_nonzero(counted)))


def _measure_odds(successes: int, count: int) -> float:
    """Return minus the logarithm of the chance of so many successes, or more, of one half each."""
    from scipy.stats import binom

    return -float(binom.logsf(successes - 1, count, 0.5))


def fit_knots(
    time: FloatArray, values: FloatArray, raster: KnotRaster, share: float = 0.0, parts: int = 1
) -> KnotFit:
    """Fit a spline with the knots of a raster; see `KnotRaster.place_knots`.

    The formulas of PCHIP and makima are compared with the rows between their knots.
    """
    from scipy.interpolate import make_lsq_spline

    nothing = KnotFit(np.empty(0), np.full(time.size, np.nan))
    knots = raster.place_knots(time, share, parts)
    if knots.size < 2 * _ENDS + 2:
        return nothing
    if raster.interpolant in (Interpolant.PCHIP, Interpolant.MAKIMA):
        return nothing if parts > 1 else _compare_between(time, values, knots, raster)
    inside = (time >= knots[0]) & (time <= knots[-1])
    x, y = time[inside], values[inside]
    order = 1 if raster.is_linear else 3
    inner = np.repeat(knots[1:-1], 2 if raster.interpolant is Interpolant.HERMITE else 1)
    grid = np.concatenate(([x[0]] * (order + 1), inner, [x[-1]] * (order + 1)))
    freedom = x.size - (grid.size - order - 1)
    if freedom < _FREE * x.size:
        return nothing
    try:
        spline = make_lsq_spline(x, y, grid, order)
    except (ValueError, np.linalg.LinAlgError):  # a piece without samples
        return nothing
    left = nothing.left.copy()
    left[inside] = (y - spline(x)) * np.sqrt(x.size / freedom)
    left[(time < knots[_ENDS]) | (time > knots[-1 - _ENDS])] = np.nan
    return KnotFit(np.asarray(spline(np.clip(knots, x[0], x[-1]))), left)


def _compare_between(
    time: FloatArray, values: FloatArray, knots: FloatArray, raster: KnotRaster
) -> KnotFit:
    """Compare rows with the interpolant of the rows nearest to `knots` (m,)."""
    from scipy.interpolate import Akima1DInterpolator, PchipInterpolator

    at = np.unique(np.searchsorted(time, knots - 1e-3 * raster.period).clip(0, time.size - 1))
    # Slopes of numbers next to zero overflow on the way to a slope of zero.
    with np.errstate(all="ignore"):
        if raster.interpolant is Interpolant.PCHIP:
            left = values - PchipInterpolator(time[at], values[at])(time)
        else:
            left = values - Akima1DInterpolator(time[at], values[at], method="makima")(time)
    left[at] = np.nan
    left[(time < knots[_ENDS]) | (time > knots[-1 - _ENDS])] = np.nan
    return KnotFit(values[at], left)


def _refine_raster(time: FloatArray, values: FloatArray, raster: KnotRaster) -> KnotRaster:
    """Search start and period near a raster with the least misfit, of a quarter, then of all."""
    from scipy.optimize import minimize

    interpolant = raster.interpolant

    def move(x: FloatArray, middle: FloatArray, scale: FloatArray) -> KnotRaster:
        start, period = middle + x * scale
        return KnotRaster(float(start), float(period), interpolant, False)

    def compute(x: FloatArray, middle: FloatArray, scale: FloatArray, part: slice) -> float:
        return fit_knots(time[part], values[part], move(x, middle, scale)).size

    for part in (slice(0, time.size // 4), slice(None)):
        length = float(time[part][-1] - time[part][0])
        start = raster.start + raster.period * round(0.5 * length / raster.period)
        scale = np.array([0.03 * raster.period, 0.1 * raster.period**2 / length])
        middle = np.array([start, raster.period])
        found = minimize(
            compute,
            np.zeros(2),
            (middle, scale, part),
            method="Nelder-Mead",
            options={"initial_simplex": [[0, 0], [1, 0], [0, 1]], "maxfev": 70, "xatol": 1e-5},
        )
        raster = move(found.x, middle, scale)
    return raster


def extend_knots(
    time: FloatArray, values: FloatArray, raster: KnotRaster
) -> tuple[FloatArray, FloatArray]:
    """Return instants [s] (m,) and values (m,) of the knots of a whole record.

    From the window of the raster it is followed both ways, as the clocks of sender and logger
    drift apart. Stretches without enough samples have no knots; both are empty where all are such.
    """
    reach = _ENDS * raster.period
    length = max(_ROWS * float(np.median(np.diff(time))), 4.0 * reach)
    count = max(int((time[-1] - time[0]) / length), 1)
    borders = np.linspace(time[0], time[-1], count + 1)
    borders[-1] = np.inf
    middle = int(np.searchsorted(borders, raster.start, side="right")) - 1
    found: dict[int, tuple[FloatArray, FloatArray]] = {}
    for way in (range(middle, count), range(middle - 1, -1, -1)):
        followed = raster
        for k in way:
            low, high = borders[k], borders[k + 1]
            part = slice(*np.searchsorted(time, (low - reach, high + reach)))
            if part.stop - part.start < _ENDS:
                continue
            followed = _follow_raster(time[part], values[part], followed)
            heights = fit_knots(time[part], values[part], followed).heights
            if heights.size:
                knots = followed.place_knots(time[part])
                inner = (knots >= low) & (knots < high)
                found[k] = knots[inner], heights[inner]
    parts = [found[k] for k in sorted(found)] or [(np.empty(0), np.empty(0))]
    return np.concatenate([at for at, _ in parts]), np.concatenate([one for _, one in parts])


def _follow_raster(time: FloatArray, values: FloatArray, raster: KnotRaster) -> KnotRaster:
    """Return the raster with the start near its own that fits a stretch best."""
    from scipy.optimize import minimize_scalar

    def move(late: float) -> KnotRaster:
        return KnotRaster(raster.start + late, raster.period, raster.interpolant, False)

    found = minimize_scalar(
        lambda late: min(fit_knots(time, values, move(late)).size, np.finfo(float).max),
        bounds=(-0.1 * raster.period, 0.1 * raster.period),
        method="bounded",
        options={"xatol": 1e-6 * raster.period},
    )
    better = found.fun < (1.0 - 1e-3) * fit_knots(time, values, raster).size
    return move(float(found.x)) if better else raster
