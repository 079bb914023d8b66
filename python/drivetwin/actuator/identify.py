# SPDX-License-Identifier: MIT
"""Identification of an actuator from commanded and measured pressure by least squares.

The residuals are linearised by differences at the minimum; their noise is estimated from the fit,
and the covariance is widened by their autocorrelation. Source: G. A. F. Seber and C. J. Wild,
Nonlinear Regression, sections 2.1 and 6.2.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
from scipy.optimize import least_squares

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import format_with_unit
from drivetwin.actuator.held_signal import HeldSignal
from drivetwin.actuator.model import QUANTITIES, REFERENCE, ActuatorModel
from drivetwin.errors import IdentificationError


@dataclass(frozen=True)
class ActuatorFitSettings:
    """Samples that are used, starts of the search, and limits of a fit."""

    before: float = 0.05
    """Time [s] before a change of the command from which samples are used."""
    after: float = 0.6
    """Time [s] after a change of the command until which samples are used."""
    samples: int = 2000
    """Largest number of samples; more are thinned evenly."""
    least_change: float = 5e4
    """Least change of the command [Pa] that a record needs."""
    dead_times: tuple[float, ...] = (0.005, 0.02, 0.05, 0.1)
    """Starting values of the dead time [s]."""
    lags: tuple[float, ...] = (0.01, 0.03, 0.1)
    """Starting values of both lags [s]."""
    kiss_shares: tuple[float, ...] = (0.35, 0.5, 0.7, 0.85, 1.0, 1.2, 1.5, 1.8, 2.2, 2.7, 3.3)
    """Starting values of the kiss pressure, over the one that is expected."""
    fill_times: tuple[float, ...] = (0.01, 0.03, 0.06, 0.1, 0.16, 0.25)
    """Starting values of the fill time [s]."""
    finalists: int = 2
    """Starts whose fit is completed, of each part of the search."""
    iterations: int = 60
    """Largest number of iterations of a fit."""
    largest_error: float = 0.05
    """Root mean square residual over the range of the pressure from which the model is refused."""


FIT = ActuatorFitSettings()
_SCALE = np.array([0.01, 0.02, 0.02, 0.5, 5e4, 0.05, 2e4])
"""Usual size of each parameter, by which the search scales it."""
_KISS, _FILL = (list(QUANTITIES).index(name) for name in ("kiss_pressure", "fill_time"))
_STEP = 2e-3
"""Step of the differences over that size."""
_DETERMINED = 1.0
"""Change of the residuals, in standard deviations of all of them together, by a change of the
usual size, below which a parameter has no influence."""


@dataclass(frozen=True, eq=False)
class PressureRecord:
    """Command [Pa] of one clutch, and its pressure (n,) [Pa] measured at `time` (n,) [s].

    `initial` [Pa] is the pressure before the first change of the command.
    """

    command: HeldSignal
    time: FloatArray
    pressure: FloatArray
    initial: float | None = None


@dataclass(frozen=True, eq=False)
class IdentifiedActuator:
    """Model of an actuator with the covariance (7, 7) of its values, in the order of `QUANTITIES`.

    A parameter that the record does not determine has an infinite variance; one from a vehicle
    card has none. `rms` [Pa] is the root mean square residual; `samples` counts the used ones.
    """

    model: ActuatorModel
    covariance: FloatArray
    rms: float = 0.0
    samples: int = 0

    @classmethod
    def from_design(cls, model: ActuatorModel) -> IdentifiedActuator:
        """Return a model from a vehicle card, which counts as exact."""
        return cls(model, np.zeros((len(QUANTITIES), len(QUANTITIES))))

    @property
    def std(self) -> FloatArray:
        """Standard deviations (7,)."""
        return np.sqrt(np.diag(self.covariance))


def identify_actuator(
    records: Sequence[PressureRecord], expected_kiss: float = REFERENCE
) -> IdentifiedActuator:
    """Identify the actuator of one clutch from one or more records.

    Parameters
    ----------
    records : commands and measured pressures
    expected_kiss : pressure [Pa] near which the search for the kiss pressure starts

    Raises
    ------
    IdentificationError
        Where the command hardly changes, or the pressure does not follow it by this model.
    """
    used = [one for one in map(_select_samples, records) if one is not None]
    if not used:
        least = format_with_unit(FIT.least_change, "Pa", digits=3)
        raise IdentificationError(
            f"the command changes by less than {least}",
            "record shifts in which the clutch is filled, closed and opened",
        )
    residuals = _Residuals(tuple(used))
    values = _search(residuals, max(expected_kiss, 2e4))
    found = _assume_undetermined(_estimate_covariance(residuals, values), expected_kiss)
    span = max(float(np.ptp(one.pressure)) for one in used)
    if not found.rms <= FIT.largest_error * span:
        raise IdentificationError(
            "the pressure does not follow its command by the actuator model: "
            f"{format_with_unit(found.rms, 'Pa', digits=3)} rms of a range of "
            f"{format_with_unit(span, 'Pa', digits=3)}",
            "check unit, sign and time of both channels, and that they are of the same clutch",
        )
    return found


def _select_samples(record: PressureRecord) -> PressureRecord | None:
    """Take the samples near changes of the command, thinned evenly; None without a change."""
    changes = record.command.drop_repeated()
    if float(np.ptp(changes.values)) < FIT.least_change:
        return None
    at = changes.time[1:]
    nearest = np.searchsorted(at, record.time)
    late = record.time - at[np.clip(nearest - 1, 0, None)]
    early = at[np.clip(nearest, None, at.size - 1)] - record.time
    near = ((nearest > 0) & (late <= FIT.after)) | ((nearest < at.size) & (early <= FIT.before))
    near &= np.isfinite(record.pressure)
    index = np.flatnonzero(near)
    if index.size < 2 * len(QUANTITIES):
        return None
    index = index[:: max(1, -(-index.size // FIT.samples))]
    calm = record.pressure[(record.time < at[0]) & np.isfinite(record.pressure)]
    initial = float(calm.mean()) if calm.size else None
    return PressureRecord(changes, record.time[index], record.pressure[index], initial)


@dataclass(frozen=True, eq=False)
class _Residuals:
    """Residuals [Pa] of all records over values in usual sizes."""

    records: tuple[PressureRecord, ...]

    def compute(self, scaled: FloatArray) -> FloatArray:
        model = ActuatorModel.from_values(scaled * _SCALE)
        return np.concatenate([self._compute_one(one, model) for one in self.records])

    @staticmethod
    def _compute_one(record: PressureRecord, model: ActuatorModel) -> FloatArray:
        computed = model.compute_pressure(record.command, record.time, record.initial)
        return computed - record.pressure

    def linearise(self, scaled: FloatArray) -> FloatArray:
        """Derivatives (n, 7) by differences that stay within the bounds."""
        low, high = _list_bounds()
        columns = []
        for k in range(scaled.size):
            up, down = scaled.copy(), scaled.copy()
            up[k], down[k] = min(up[k] + _STEP, high[k]), max(down[k] - _STEP, low[k])
            columns.append((self.compute(up) - self.compute(down)) / (up[k] - down[k]))
        return np.column_stack(columns)


def _list_bounds() -> tuple[FloatArray, FloatArray]:
    low = np.array([one.lower for one in QUANTITIES.values()])
    high = np.array([one.upper for one in QUANTITIES.values()])
    return low / _SCALE, high / _SCALE


def _search(residuals: _Residuals, expected_kiss: float) -> FloatArray:
    """Return the values in usual sizes with the least squares.

    Kiss pressure and fill time have local minima. They are searched on a grid twice: coarsely with
    all starts of the other parameters, and finely with those that the first fit has found.
    """
    kisses, fills = np.array(FIT.kiss_shares) * expected_kiss, np.array(FIT.fill_times)
    first = [
        np.array([dead, lag, lag, 1.0, kiss, fill, 1e4]) / _SCALE
        for dead, lag, kiss, fill in product(FIT.dead_times, FIT.lags, kisses[::4], fills[::2])
    ]
    fit = _fit_best(residuals, first)
    second = []
    for kiss, fill in product(kisses, fills):
        start = fit[0].copy()
        start[[_KISS, _FILL]] = kiss / _SCALE[_KISS], fill / _SCALE[_FILL]
        second.append(start)
    return min(fit, _fit_best(residuals, second), key=lambda one: one[1])[0]


def _fit_best(residuals: _Residuals, starts: Sequence[FloatArray]) -> tuple[FloatArray, float]:
    """Fit from the best of the starts; return the values in usual sizes and their cost."""
    costs = [float(np.square(residuals.compute(one)).sum()) for one in starts]
    low, high = _list_bounds()
    fits = [
        least_squares(
            residuals.compute,
            np.clip(starts[k], low + 1e-6, high - 1e-6),
            residuals.linearise,
            bounds=(low, high),
            xtol=1e-7,
            ftol=1e-9,
            max_nfev=FIT.iterations,
        )
        for k in np.argsort(costs)[: FIT.finalists]
    ]
    best = min(fits, key=lambda one: float(one.cost))
    return np.asarray(best.x, dtype=np.float64), float(best.cost)


def _estimate_covariance(residuals: _Residuals, scaled: FloatArray) -> IdentifiedActuator:
    left, slopes = residuals.compute(scaled), residuals.linearise(scaled)
    size = left.size
    variance = float(left @ left) / max(size - scaled.size, 1)
    strength = np.linalg.norm(slopes, axis=0)
    known = strength > _DETERMINED * np.sqrt(variance)
    columns = slopes[:, known]
    covariance = np.zeros((scaled.size, scaled.size))
    inner = np.linalg.pinv(columns.T @ columns) * variance * _compute_inflation(left)
    covariance[np.ix_(known, known)] = inner
    covariance *= np.outer(_SCALE, _SCALE)
    covariance[~known, ~known] = np.inf
    return IdentifiedActuator(
        ActuatorModel.from_values(scaled * _SCALE), covariance, float(np.sqrt(variance)), size
    )


def _assume_undetermined(found: IdentifiedActuator, kiss: float) -> IdentifiedActuator:
    """Assume what the records do not determine.

    A lag is that of the other direction; the clutch is filled at once, at the pressure `kiss` [Pa].
    """
    unknown = dict(zip(QUANTITIES, np.isinf(found.std), strict=True))
    model = found.model
    assumed = {
        "rising_lag": model.falling_lag,
        "falling_lag": model.rising_lag,
        "damping": 1.0,
        "kiss_pressure": kiss,
        "fill_time": 0.0,
        "hysteresis": 0.0,
    }
    changed = {name: value for name, value in assumed.items() if unknown[name]}
    return replace(found, model=replace(model, **changed))


def _compute_inflation(left: FloatArray) -> float:
    """Factor on the variance of a mean by the autocorrelation of the residuals, at least 1.

    The sum of the autocorrelations ends at the first that is not above chance (2/√n).
    """
    centred = left - left.mean()
    power = float(centred @ centred)
    if power <= 0.0:
        return 1.0
    factor, limit = 1.0, 2.0 / np.sqrt(left.size)
    for lag in range(1, left.size // 4):
        share = float(centred[lag:] @ centred[:-lag]) / power
        if share <= limit:
            break
        factor += 2.0 * share
    return factor
