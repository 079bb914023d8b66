# SPDX-License-Identifier: MIT
"""Likelihood of measured clutch pressures, with the numbers of the actuators as unknowns.

Priors are usual ranges of hydraulic actuators. Kiss pressure and fill time have local minima: the
search starts from the best points of a grid.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from math import hypot, sqrt
from typing import Self

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import format_with_unit
from drivetwin.actuator.model import QUANTITIES, ActuatorModel, IdentifiedActuator
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.actuators import PressureRecord
from drivetwin.findings import Code, Finding, report
from drivetwin.likelihood.gauss_newton import OptimizeResult, minimise
from drivetwin.likelihood.measured_signal import count_repeats
from drivetwin.likelihood.objective import LikelihoodObjective
from drivetwin.likelihood.output import ComparedOutputs, Output
from drivetwin.likelihood.point import ParameterVector, Prior
from drivetwin.likelihood.residual_covariance import Whitener, build_sensor_whitener
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.vehicle.spec import PriorValue

_USUAL = {
    "dead_time": (0.04, 0.03),
    "rising_lag": (0.03, 0.02),
    "falling_lag": (0.03, 0.02),
    "damping": (1.0, 0.25),
    "kiss_pressure": (0.0, 5e4),
    "fill_time": (0.15, 0.1),
    "hysteresis": (1.5e4, 1e4),
}
"""Means and standard deviations of usual actuators, SI; the kiss pressure lies about P0."""
_KISS, _FILL = (list(QUANTITIES).index(name) for name in ("kiss_pressure", "fill_time"))
_LOWER, _UPPER = np.array([(one.lower, one.upper) for one in QUANTITIES.values()]).T
_LEAST_KISS = 2e4
"""Least kiss pressure [Pa] near which a search starts."""
_DEAD_TIMES, _LAGS = (0.005, 0.02, 0.05, 0.1), (0.01, 0.03, 0.1)
_KISSES = (0.35, 0.5, 0.7, 0.85, 1.0, 1.2, 1.5, 1.8, 2.2, 2.7, 3.3)
_FILLS = (0.01, 0.03, 0.06, 0.1, 0.16, 0.25)
"""Starts: dead times and lags [s], kiss pressures over P0, fill times [s]."""
_FINALISTS = 2
"""Starts of a grid from which the search begins [count]."""
_STEP = 2e-3
"""Step of a difference [standard deviations of the prior]."""
_LEAST_CHANGE = 5e4
"""Least change of the command [Pa] that a record needs."""
_LARGEST_ERROR = 0.05
"""Root mean square residual over the range of the pressure from which the model is refused."""
_LEAST_NOISE = 1.0
"""Least noise of a pressure [Pa]: no sensor has a finer step."""
_ROUNDS = 2
"""Fits with the noise of the residuals of the fit before [count]."""


@dataclass(frozen=True, eq=False)
class _Rows(ComparedOutputs):
    """Compared pressures at `time` (n,) [s]."""

    time: FloatArray
    outputs: tuple[Output, ...]


@dataclass(frozen=True, eq=False)
class _PressureTerm:
    """Pressure of a record behind the actuator whose values are the unknowns; `steps` (7,) are
    those of differences, SI."""

    source: PressureRecord
    record: _Rows
    weighting: Whitener
    steps: FloatArray
    label: str = ""
    inputs: Mapping[str, Signal] = field(default_factory=dict)
    speeds: list[str] = field(default_factory=list)

    def weigh(self, sigma: float) -> Self:
        """Weigh all samples by one noise [Pa]."""
        return replace(self, weighting=build_sensor_whitener(np.full(self.record.size, sigma)))

    def evaluate(self, point: ParameterVector) -> FloatArray:
        """Compute the residual (n,) [Pa]."""
        one = self.source
        model = ActuatorModel.from_values(np.clip(point.values, _LOWER, _UPPER))
        return one.pressure - model.compute_pressure(one.command, one.time, one.initial)

    def linearise(self, point: ParameterVector) -> tuple[FloatArray, FloatArray]:
        """Compute the residual (n,) and the derivatives (n, 7) by differences within the bounds."""
        columns = []
        for place, step in enumerate(self.steps):
            ends = np.array([point.values, point.values])
            ends[:, place] += -step, step
            low, high = np.clip(ends, _LOWER, _UPPER)
            before, after = (self.evaluate(point.replace_values(one)) for one in (low, high))
            columns.append((before - after) / (high - low)[place])
        return self.evaluate(point), np.column_stack(columns)

    def update_weighting(self, point: ParameterVector) -> Self:
        """Return the term as it is: its noise is estimated over all records."""
        del point
        return self

    def update_inputs(self, point: ParameterVector) -> Self:
        """Return the term as it is: a command has no noise."""
        del point
        return self


_Problem = LikelihoodObjective[_PressureTerm]
_Found = OptimizeResult[_Problem]


@dataclass(frozen=True, eq=False)
class FoundActuators:
    """Actuators by element, and the findings on them."""

    actuators: Mapping[str, IdentifiedActuator]
    findings: tuple[Finding, ...]


def identify_actuators(
    records: Mapping[str, Sequence[PressureRecord]], P0: Mapping[str, PriorValue]
) -> FoundActuators:
    """Identify the actuator of each element from its `records`; `P0` are design values by element.

    A finding names an element whose pressure does not follow its command, and the parameters of
    which usual ranges say more than the records.
    """
    found: dict[str, IdentifiedActuator] = {}
    findings = []
    for name, some in records.items():
        try:
            one = found[name] = identify_actuator(some, P0[name])
        except IdentificationError as error:
            findings.append(report(Code.ACTUATOR_NOT_IDENTIFIED, name, why=error.what))
            continue
        if unknown := [*_list_undetermined(one, P0[name])]:
            findings.append(report(Code.ACTUATOR_UNDETERMINED, name, names=", ".join(unknown)))
    return FoundActuators(found, tuple(findings))


def identify_actuator(records: Sequence[PressureRecord], P0: PriorValue) -> IdentifiedActuator:
    """Identify the actuator of one clutch from one or more records.

    Raises
    ------
    IdentificationError
        Where the command hardly changes, or the pressure does not follow it by this model.
    """
    chosen = (one.select_changes() for one in records)
    used = [one for one in chosen if one.time.size and np.ptp(one.command.values) >= _LEAST_CHANGE]
    if not used:
        least = format_with_unit(_LEAST_CHANGE, "Pa", digits=3)
        raise IdentificationError(
            f"the command changes by less than {least}",
            "record shifts in which the clutch is filled, closed and opened",
        )
    mean, std = _get_prior(P0)
    span = max(float(np.ptp(one.pressure)) for one in used)
    prior = Prior(mean, np.diag(std**-2))
    terms = tuple(_build_term(one, _LARGEST_ERROR * span, _STEP * std) for one in used)
    problem = _Problem(terms, prior, _LOWER, _UPPER, std)
    found = _search(problem, max(P0.value, _LEAST_KISS))
    for _ in range(_ROUNDS):
        left = [term.evaluate(found.point) for term in terms]
        rms = sqrt(np.mean(np.concatenate(left) ** 2))
        sigma = max(rms * sqrt(count_repeats(left)), _LEAST_NOISE)
        problem = replace(problem, terms=tuple(one.weigh(sigma) for one in terms))
        found = _require(minimise(problem, found.point))
    if not rms <= _LARGEST_ERROR * span:
        raise IdentificationError(
            "the pressure does not follow its command by the actuator model: "
            f"{format_with_unit(rms, 'Pa', digits=3)} rms of a range of "
            f"{format_with_unit(span, 'Pa', digits=3)}",
            "check unit, sign and time of both channels, and that they are of the same clutch",
        )
    covariance = np.asarray(np.linalg.inv(found.normal.information))
    model = ActuatorModel.from_values(found.point.values)
    return IdentifiedActuator(model, covariance, rms, problem.size)


def _get_prior(P0: PriorValue) -> tuple[FloatArray, FloatArray]:
    """Return means and standard deviations (7,) of usual actuators of an element."""
    mean, std = np.array([_USUAL[name] for name in QUANTITIES]).T
    mean[_KISS] += P0.value
    std[_KISS] = hypot(std[_KISS], P0.std)
    return mean, std


def _list_undetermined(one: IdentifiedActuator, P0: PriorValue) -> Iterator[str]:
    """List the parameters of which the prior has more information than the records."""
    _, std = _get_prior(P0)
    for spec, left, before in zip(QUANTITIES.values(), one.std, std, strict=True):
        if left > sqrt(0.5) * before:
            yield spec.label


def _build_term(record: PressureRecord, sigma: float, steps: FloatArray) -> _PressureTerm:
    index = np.arange(record.time.size)
    rows = _Rows(record.time, (Output("pressure", index, record.pressure, sigma),))
    return _PressureTerm(record, rows, build_sensor_whitener(rows.sigma), steps)


def _search(problem: _Problem, kiss: float) -> _Found:
    """Search coarsely with all starts, then kiss pressure and fill time about the best fit."""
    kisses = [share * kiss for share in _KISSES]
    coarse = [
        np.array([dead, lag, lag, 1.0, own, fill, 1e4])
        for dead, lag, own, fill in product(_DEAD_TIMES, _LAGS, kisses[::4], _FILLS[::2])
    ]
    first = _fit_best(problem, coarse)
    fine = np.tile(first.point.values, (len(kisses) * len(_FILLS), 1))
    fine[:, [_KISS, _FILL]] = [*product(kisses, _FILLS)]
    return min(first, _fit_best(problem, fine), key=lambda one: one.normal.cost)


def _fit_best(problem: _Problem, starts: Iterable[FloatArray]) -> _Found:
    """Return the least of the minima from the best of the starts."""
    points = [ParameterVector(tuple(QUANTITIES), one) for one in starts]
    points.sort(key=problem.cost)
    found = [_require(minimise(problem, one, rough=True)) for one in points[:_FINALISTS]]
    return min(found, key=lambda one: one.normal.cost)


def _require(found: _Found | None) -> _Found:
    assert found is not None  # the model has a pressure for all values within the bounds
    return found
