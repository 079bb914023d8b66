# SPDX-License-Identifier: MIT
"""One likelihood of many shifts: shared numbers, numbers of each shift, and the common scale."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.channels.units import RPM
from drivetwin.fit.plant import Problem
from drivetwin.likelihood.measured_signal import count_repeats
from drivetwin.likelihood.point import ParameterVector, Prior
from drivetwin.likelihood.residual_covariance import build_sensor_whitener
from drivetwin.tcu.card import ControllerCard
from drivetwin.tcu.log import SPEEDS, ControllerShift
from drivetwin.tcu.plant import build_term
from drivetwin.tcu.unknowns import J_VEHICLE, Own, Stated, find_own

_REACH = 2.0
"""Largest change of a number in one step of the search [standard deviations of its prior]."""


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Coordinates of the search: shared numbers, the scale `J_vehicle`, numbers of the shifts.

    `to_absolute` (p, p) turns coordinates into those of absolute numbers: torques and inertias grow
    with the scale.
    """

    stated: Mapping[str, Stated]
    names: tuple[str, ...]
    mean: FloatArray
    spread: FloatArray
    to_absolute: FloatArray

    @property
    def scale(self) -> int:
        """Place of the scale."""
        return self.names.index(J_VEHICLE)

    @property
    def prior(self) -> Prior:
        """Prior of the coordinates: independent priors of the absolute numbers."""
        weight = self.spread**-2.0
        return Prior(self.mean, self.to_absolute.T @ (weight[:, None] * self.to_absolute))

    def resize(self, sizes: Mapping[Own, float]) -> Coordinates:
        """Multiply the deviations of numbers of a shift by `sizes`."""
        kinds = [find_own(name) for name in self.names]
        factors = [1.0 if one is None else sizes.get(one, 1.0) for one in kinds]
        return replace(self, spread=self.spread * factors)

    def get_shared(self) -> list[str]:
        """Return the names of numbers of no single shift."""
        return [name for name in self.names if not name.startswith("shift ")]

    def to_values(self, coordinates: FloatArray) -> dict[str, float]:
        """Compute the absolute numbers by name, SI but for pressures in bar."""
        absolute = self.mean + self.to_absolute @ (coordinates - self.mean)
        factor = float(np.exp(coordinates[self.scale] - self.mean[self.scale]))
        found = {}
        for name, value in zip(self.names, absolute.tolist(), strict=True):
            stated = self.stated[name]
            if stated.is_positive:
                found[name] = float(np.exp(np.clip(value, -40.0, 40.0)))
            else:
                found[name] = value * factor if stated.scaled else value
        return found


def build_problem(
    card: ControllerCard,
    shifts: Sequence[ControllerShift],
    sizes: Mapping[Own, float] | None = None,
) -> tuple[Problem, ParameterVector, Coordinates]:
    """Build the likelihood of shifts, its first point and its coordinates.

    `sizes` are factors of the stated deviations of numbers of a shift.
    """
    terms, numbers, stated = [], {}, {}
    for shift in shifts:
        term, there = build_term(card, shift)
        terms.append(term)
        stated.update(there)
        numbers.update({one.name: one for one in term.plant.sought})
    shared = [name for name in numbers if not name.startswith("shift ")]
    names = (*shared, J_VEHICLE, *(name for name in numbers if name not in set(shared)))
    mass = card.vehicle_inertia
    stated[J_VEHICLE] = Stated(mass.value, mass.std / mass.value, "kg*m^2")
    sought = [numbers[name] if name != J_VEHICLE else None for name in names]
    mean = np.array([np.log(mass.value) if one is None else one.start for one in sought])
    spread = np.array([stated[name].std for name in names])
    to_absolute = np.eye(len(names))
    grows = [k for k, name in enumerate(names) if stated[name].scaled and stated[name].is_positive]
    to_absolute[grows, names.index(J_VEHICLE)] = 1.0
    coordinates = Coordinates(stated, names, mean, spread, to_absolute)
    coordinates = coordinates.resize(sizes or {})
    limits = [(-np.inf, np.inf) if one is None else one.limits for one in sought]
    lower, upper = np.array(limits).T
    problem = Problem(tuple(terms), coordinates.prior, lower, upper, _REACH * spread)
    return problem, ParameterVector(names, mean.copy()), coordinates


@dataclass(frozen=True, eq=False)
class RowNoise:
    """Noise of the rows by output: standard deviation `sigma` [rad/s], and `repeats`, the number of
    rows that carry the information of one."""

    sigma: Mapping[str, float]
    repeats: Mapping[str, float]

    @property
    def own(self) -> dict[str, float]:
        """Standard deviation of a row that counts as independent, by output."""
        return {name: one * float(np.sqrt(self.repeats[name])) for name, one in self.sigma.items()}

    @property
    def shared(self) -> dict[str, float]:
        """Standard deviation of a row for numbers of all shifts, by output: with errors of laws."""
        return {name: max(one, FLOOR * np.sqrt(_FLOOR_REPEATS)) for name, one in self.own.items()}


LOOSE = RowNoise(
    dict(zip(SPEEDS, (8.0 * RPM, 6.0 * RPM, 4.0 * RPM), strict=True)),
    dict.fromkeys(SPEEDS, 8.0),
)
"""Noise far from the minimum: what is not yet fitted is no noise of a sensor."""
_LEAST_SIGMA = 0.6 * RPM
"""Least noise of a row: rounding to whole revolutions, and jitter of the task [rad/s]."""
FLOOR, _FLOOR_REPEATS = 3.0 * RPM, 10.0
"""Noise [rad/s] and repeats below which model errors of usual size are not excluded: residuals at
the sensors' noise show no error of a law that other numbers have taken up."""


_FAR = 3.0
"""Residual from which a row weighs less (Huber 1964) [standard deviations]."""


def weigh(
    problem: Problem, sigma: Mapping[str, float], point: ParameterVector | None = None
) -> Problem:
    """Weigh the rows by the noise `sigma` of each output.

    About a `point`, rows beyond 3 deviations weigh less, so that their influence is bounded.
    """
    terms = []
    for term in problem.terms:
        outputs = term.record.outputs
        every = np.concatenate([np.full(one.values.size, sigma[one.name]) for one in outputs])
        residual = None if point is None else term.evaluate(point)
        if residual is not None:
            every *= np.sqrt(np.maximum(np.abs(residual) / (_FAR * every), 1.0))
        terms.append(replace(term, weighting=build_sensor_whitener(every)))
    return replace(problem, terms=tuple(terms))


def estimate_noise(problem: Problem, point: ParameterVector) -> RowNoise:
    """Estimate the noise of the rows from the residuals: variance times autocorrelation time."""
    residuals: dict[str, list[FloatArray]] = {name: [] for name in SPEEDS}
    for term in problem.terms:
        found = term.evaluate(point)
        if found is None:
            continue
        first = 0
        for out in term.record.outputs:
            residuals[out.name].append(found[first : first + out.values.size])
            first += out.values.size
    sigma, repeats = {}, {}
    for name, parts in residuals.items():
        size = float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
        sigma[name] = max(size, _LEAST_SIGMA)
        repeats[name] = count_repeats(parts)
    return RowNoise(sigma, repeats)


_VARYING = ((Own.OFFSET,), (Own.GAIN_OFF, Own.GAIN_ON), (Own.FILL,), (Own.RATE,))
"""Numbers of a shift by errors of one kind, whose size the shifts themselves show."""
_SIZES = np.geomspace(0.01, 10.0, 61)
"""Sizes that are weighed, over the stated deviation: a hundredth of it acts on no row."""
_SIZE_SPREAD = 1.0
"""Deviation of the logarithm of a size over vehicles, whose root mean square is the stated
deviation."""


def estimate_sizes(
    coordinates: Coordinates, point: ParameterVector, covariance: FloatArray
) -> dict[Own, float]:
    """Estimate the deviations of the numbers that vary from shift to shift, over the stated ones.

    A size is the root of the mean square of its distribution, given the values (p,) at the
    minimum and their `covariance` (p, p). Without information it is 1.
    """
    apart = (point.values - coordinates.mean) / coordinates.spread
    share = np.clip(np.diag(covariance) / coordinates.spread**2, 1e-6, 1.0 - 1e-6)
    kinds = [find_own(name) for name in coordinates.names]
    found = {}
    for group in _VARYING:
        places = [k for k, kind in enumerate(kinds) if kind in group]
        own = share[places] / (1.0 - share[places])
        seen = apart[places] / (1.0 - share[places])
        variance = own + _SIZES[:, None] ** 2
        score = np.sum(np.log(variance) + seen**2 / variance, axis=1)
        score += (np.log(_SIZES) / _SIZE_SPREAD + _SIZE_SPREAD) ** 2
        odds = np.exp(-0.5 * (score - score.min()))
        size = float(np.sqrt(odds @ _SIZES**2 / odds.sum()))
        found.update(dict.fromkeys(group, size))
    return found
