# SPDX-License-Identifier: MIT
"""Array types, time stamps kept as long as their arrays, and filters of sampled signals."""

from __future__ import annotations

import json
import math
import weakref
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import wraps
from typing import Any, ParamSpec, TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


Span = tuple[float, float]


LONGEST_SPAN = 1e10
"""Longest time [s] that a record may span: 300 years, more than any clock of a logger shows."""

SHORTEST_STEP = 2.5e-5
"""Shortest plausible median time [s] between stamps. Stamps of 50 Hz in s that are read as ms
(2e-5 s) are below."""

P = ParamSpec("P")
Result = TypeVar("Result")


def remember_for_arrays(function: Callable[P, Result]) -> Callable[P, Result]:
    """Keep the result of a function of arrays as long as these exist.

    Nobody may change the arrays, and the result must not refer to them. Arrays are passed by
    position.
    """
    known: dict[tuple[int, ...], tuple[tuple[weakref.ref[object], ...], Result]] = {}

    @wraps(function)
    def remembered(*arrays: P.args, **none: P.kwargs) -> Result:
        key = tuple(map(id, arrays))
        found = known.get(key)
        if found is not None:
            return found[1]
        result = function(*arrays, **none)
        references = tuple(weakref.ref(one, lambda _: known.pop(key, None)) for one in arrays)
        known[key] = references, result
        return result

    return remembered


NEGLIGIBLE = 1e-9
"""Variance of a direction over the largest below which it is rounding [ratio]."""


def compute_directions(covariance: FloatArray) -> FloatArray:
    """Return columns (p, r) of one standard deviation each, independent, of a `covariance` (p, p).

    They are those of the correlations, because the units of the values may differ by many powers
    of ten.
    """
    scale = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    unit = covariance / np.outer(*(np.where(scale > 0.0, scale, np.inf),) * 2)
    power, axes = np.linalg.eigh(unit)
    kept = power > NEGLIGIBLE * max(1.0, float(power[-1]))
    return np.asarray(scale[:, None] * axes[:, kept] * np.sqrt(power[kept]))


def propagate_variance(slopes: FloatArray, covariance: FloatArray) -> FloatArray:
    """Return the variances (n,) of values with `slopes` (n, p) by parameters of a `covariance`
    (p, p)."""
    return np.asarray(np.maximum(np.sum((slopes @ covariance) * slopes, axis=1), 0.0))


@remember_for_arrays
def compute_median_step(time: FloatArray) -> float:
    """Return the median distance [s] of the stamps `time` (n,), n > 1."""
    return float(np.median(np.diff(time), overwrite_input=True))


@remember_for_arrays
def is_time_axis(time: FloatArray) -> bool:
    """Return whether the stamps `time` (n,) [s] have order, span and step of a record.

    Others are refused by the checks of channels. Code that looks at a record before these checks
    asks here, because a span of 1e300 s or a step of 1e-300 s makes its numbers meaningless.
    """
    if time.size < 2 or not np.isfinite(time).all():
        return False
    if np.any(time[1:] < time[:-1]) or float(time[-1]) - float(time[0]) >= LONGEST_SPAN:
        return False
    return compute_median_step(time) >= SHORTEST_STEP


_ROUND_OFF = 1e-9
"""Distance of two numbers, relative to the largest, below which they are one number."""
_MIN_CHANGES = 10
"""Least number of changes that show a rounding step."""
_MULTIPLE_TOLERANCE = 1e-3
"""Largest deviation of a distance from a multiple of the rounding step, in steps."""


def compute_moving_mean(values: FloatArray, width: int) -> FloatArray:
    """Return the centred mean (n,) of `values` (n,) over `width` samples.

    Towards both ends the window shrinks on both sides alike, so that constants and ramps are kept
    up to the first and last sample. An even window reaches one sample further back.
    """
    if width <= 1 or values.size <= 2:
        return values.astype(np.float64)
    before, after = width // 2, (width - 1) // 2
    index = np.arange(values.size)
    reach = np.minimum(index, index[::-1])
    mean = np.empty(values.size)
    inner = (index >= before) & (index < values.size - after)
    if inner.any():
        mean[inner] = np.convolve(values, np.ones(width) / width, mode="valid")
    for sample in index[~inner]:
        mean[sample] = values[sample - reach[sample] : sample + reach[sample] + 1].mean()
    return mean


def integrate_trapezoids(values: FloatArray, time: FloatArray) -> FloatArray:
    """Return the integral of `values` (n, ...) over `time` (n,) from the first sample on."""
    total = np.zeros(values.shape)
    areas = np.add(values[1:], values[:-1], out=total[1:])
    areas *= (np.diff(time) / 2.0).reshape(-1, *(1,) * (values.ndim - 1))
    return np.cumsum(total, axis=0, out=total)


def find_largest(values: FloatArray) -> float:
    """Return the largest magnitude in `values` (n,); 0 without any."""
    return max(float(values.max(initial=0.0)), -float(values.min(initial=0.0)))


_BLOCKS, _BLOCK = 64, 2048
"""Blocks of a long record, and rows of a block [count], that show steps and noise: cost of work."""


def sample_blocks(values: FloatArray) -> FloatArray:
    """Return evenly spread blocks of a record (n,), one a row; a short record is one block."""
    if values.size <= _BLOCKS * _BLOCK:
        return values[None]
    starts = np.linspace(0, values.size - _BLOCK, _BLOCKS).astype(int)
    return np.asarray(values[starts[:, None] + np.arange(_BLOCK)])


_PART = 1 << 16
"""Samples that are looked at together [count]: they fit the cache of a processor core."""


def find_large_steps(values: FloatArray, least: float) -> NDArray[np.intp]:
    """Return the samples (m,) of a record (n,) after which it steps by more than `least`."""
    found = [np.empty(0, np.intp)]
    for start in range(0, values.size, _PART):
        steps = np.diff(values[start : start + _PART + 1])
        found.append(start + np.flatnonzero((steps > least) | (steps < -least)))
    return np.concatenate(found)


def find_true_runs(mask: NDArray[np.bool_], least: int = 1) -> list[tuple[int, int]]:
    """Return first index and end (one past the last) of each run of True in `mask` (n,).

    Runs of fewer than `least` samples are left out.
    """
    starts, ends = find_run_bounds(mask)
    if least > 1:
        long = ends - starts >= least
        starts, ends = starts[long], ends[long]
    return list(zip(starts.tolist(), ends.tolist(), strict=True))


def find_run_bounds(mask: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return first indices (m,) and ends (m,), one past the last, of the runs of True in `mask`
    (n,)."""
    if not mask.size:
        return np.empty(0, np.intp), np.empty(0, np.intp)
    starts = np.flatnonzero(mask[1:] & ~mask[:-1]) + 1
    ends = np.flatnonzero(mask[:-1] & ~mask[1:]) + 1
    starts = np.concatenate(([0], starts)) if mask[0] else starts
    ends = np.concatenate((ends, [mask.size])) if mask[-1] else ends
    return starts, ends


def estimate_resolution(values: FloatArray) -> float:
    """Return the least distance of two different numbers in `values` (n,); 0 if all are one.

    Successive samples need not show it: along a ramp they may be many steps apart.
    """
    return _measure_gaps(values)[0]


def estimate_rounding_step(values: FloatArray) -> float:
    """Return the resolution of `values` (n,) if all their numbers are multiples of it apart.

    0 otherwise, and for fewer than 10 changes, which do not show a rounding step.
    """
    step, is_lattice = _measure_gaps(values)
    if not is_lattice:
        return 0.0
    least = _find_round_off(values)
    return step if np.count_nonzero(np.abs(np.diff(values)) > least) >= _MIN_CHANGES else 0.0


@remember_for_arrays
def _measure_gaps(values: FloatArray) -> tuple[float, bool]:
    """Return the least distance of neighbouring numbers in sorted order, 0 if all are one, and
    whether all distances are its multiples. Those of round-off do not count."""
    gaps = np.diff(np.unique(values))
    gaps = gaps[gaps > _find_round_off(values)]
    if not gaps.size:
        return 0.0, False
    step = float(gaps.min())
    multiples = gaps / step
    deviation = float(np.max(np.abs(multiples - np.round(multiples))))
    return step, deviation < _MULTIPLE_TOLERANCE


def _find_round_off(values: FloatArray) -> float:
    """Return the distance below which two of the `values` (n,) are one number."""
    return _ROUND_OFF * max(find_largest(values), _ROUND_OFF)


def apply_lag(values: FloatArray, step: float, time_constant: float) -> FloatArray:
    """Apply a first-order lag [s] to `values` (n,), sampled every `step` [s], at rest before them.

    The lag is solved exactly for an input that is linear between the samples.
    """
    decay = np.exp(-step / time_constant)
    mean = time_constant / step * (1.0 - decay)
    return _filter(values, np.array([1.0 - mean, mean - decay]), np.array([1.0, -decay]))


_PADDING = 9
"""Samples of the odd extension at both ends: three times the number of coefficients."""


def filter_zero_phase(values: FloatArray, step: float, cutoff: float) -> FloatArray:
    """Low-pass `values` (n,), sampled every `step` [s], by a Butterworth of order 2 run both ways.

    `cutoff` [Hz] is that of one run, below half the sampling rate; n exceeds 9. Both ends are
    extended by their point reflection, and each run starts in the steady state of its first value.

    References
    ----------
    F. Gustafsson, Determining the initial states in forward-backward filtering, IEEE Transactions
    on Signal Processing 44 (1996).
    """
    head = 2.0 * values[0] - values[_PADDING:0:-1]
    tail = 2.0 * values[-1] - values[-2 : -_PADDING - 2 : -1]
    forward = apply_low_pass(np.concatenate([head, values, tail]), step, cutoff)
    both = apply_low_pass(forward[::-1], step, cutoff)[::-1]
    return np.asarray(both[_PADDING:-_PADDING])


def apply_low_pass(values: FloatArray, step: float, cutoff: float) -> FloatArray:
    """Low-pass `values` (n,), sampled every `step` [s] and at rest before them, by a Butterworth of
    order 2 with a `cutoff` [Hz] below half the sampling rate."""
    k = float(np.tan(np.pi * cutoff * step))
    scale = 1.0 / (1.0 + np.sqrt(2.0) * k + k**2)
    moving = scale * k**2 * np.array([1.0, 2.0, 1.0])
    recursive = np.array([1.0, 2.0 * scale * (k**2 - 1.0), scale * (1.0 - np.sqrt(2.0) * k + k**2)])
    return _filter(values, moving, recursive)


def _filter(values: FloatArray, moving: FloatArray, recursive: FloatArray) -> FloatArray:
    """Run the filter Σ recursive·y = Σ moving·x, at rest at the first value before it."""
    from scipy.linalg import solve_banded

    change = values - values[0]
    driven = np.convolve(change, moving)[: change.size]
    bands = np.repeat(recursive[:, None], change.size, axis=1)
    return np.asarray(values[0] + solve_banded((recursive.size - 1, 0), bands, driven))


def convert_nonfinite(value: object) -> object:
    """Turn NaN and infinities into None: neither exists in JSON."""
    return None if isinstance(value, float) and not math.isfinite(value) else value


def to_plain_values(value: Any) -> Any:
    """Reduce values to JSON and TOML types: enums to values, arrays to lists, NaN to None, and
    dataclasses to their fields by name."""
    if is_dataclass(value) and not isinstance(value, type):
        value = {one.name: getattr(value, one.name) for one in fields(value)}
    if isinstance(value, Enum):
        return to_plain_values(value.value)
    if isinstance(value, np.ndarray | np.generic):
        return to_plain_values(value.tolist())
    if isinstance(value, dict):
        return {str(key): to_plain_values(item) for key, item in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [to_plain_values(item) for item in value]
    if isinstance(value, bool | int | str | None):
        return value
    return convert_nonfinite(value) if isinstance(value, float) else str(value)


def format_json(value: Any) -> str:
    """Write a value as strict JSON text: no NaN, plain types, readable."""
    text = json.dumps(to_plain_values(value), allow_nan=False, ensure_ascii=False, indent=2)
    return text + "\n"
