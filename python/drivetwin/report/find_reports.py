# SPDX-License-Identifier: MIT
"""Inputs of a comparison: several identifications, and their simulations of common logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.estimation.result.estimate import Estimate, FrictionCurve
from drivetwin.estimation.result.validation import Validation
from drivetwin.likelihood.signal_fit import SignalFit
from drivetwin.twin.twin import Twin

DIFFER = 2.58
"""Difference in its standard deviations from which two values differ: 1 % by chance."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """One identification under the `name` that tables and figures give it.

    `fit` by signal and phase is empty where only the twin is at hand.
    """

    name: str
    method: str
    estimates: Mapping[str, Estimate]
    friction: Mapping[str, FrictionCurve]
    fit: Mapping[str, Mapping[str, SignalFit]]
    inputs: Mapping[str, str]
    version: str

    @classmethod
    def from_twin(cls, name: str, twin: Twin) -> Candidate:
        """Create a candidate from a twin file."""
        return cls(name, twin.method, twin.parameters, twin.friction, {}, twin.inputs, twin.version)


@dataclass(frozen=True, eq=False)
class Trial:
    """One shift of a log, simulated by each candidate; `refused` holds the reasons of failures.

    `label` names log and shift.
    """

    label: str
    runs: Mapping[str, Validation]
    refused: Mapping[str, str]


@dataclass(frozen=True)
class Agreement:
    """One parameter over the candidates, in their order; None if a candidate has no estimate.

    `mean` is weighted by the inverse variances; `apart` is the largest difference of two
    candidates in its standard deviations (sensor tolerances included). A value without an interval
    is held against those of the others as if it were exact; None where no value with an interval
    has another beside it.
    """

    id: str
    estimates: tuple[Estimate | None, ...]
    mean: float
    apart: float | None

    @property
    def known(self) -> Estimate:
        """Estimate of the first candidate that has one."""
        return next(one for one in self.estimates if one is not None)

    @property
    def bare(self) -> tuple[int, ...]:
        """Indices of the candidates with a value but without an interval."""
        given = [(k, one) for k, one in enumerate(self.estimates) if one and one.value is not None]
        return tuple(k for k, one in given if not _has_interval(one.std_total))

    @property
    def agrees(self) -> bool | None:
        """True if the values agree within their uncertainty; None if the uncertainty is unknown."""
        return None if self.apart is None else self.apart <= DIFFER


def compare_estimates(candidates: Sequence[Mapping[str, Estimate]]) -> list[Agreement]:
    """Compare every parameter that some candidate estimates, in the order of the first such one."""
    ids = dict.fromkeys(name for one in candidates for name in one)
    found = (_compare_parameter(name, [one.get(name) for one in candidates]) for name in ids)
    return [one for one in found if one is not None]


def _compare_parameter(name: str, estimates: Sequence[Estimate | None]) -> Agreement | None:
    given = [(one.value, one.std_total) for one in estimates if one and one.value is not None]
    if not given:
        return None
    values = np.array([value for value, _ in given])
    stds = np.array([np.nan if std is None else std for _, std in given])
    known = np.array([_has_interval(std) for _, std in given])
    weights = np.where(known, 1.0 / np.where(known, stds, 1.0) ** 2, 0.0)
    mean = float(np.average(values, weights=weights if known.any() else None))
    spread = np.where(known, stds, 0.0)
    apart = [
        abs(values[i] - values[j]) / np.hypot(spread[i], spread[j])
        for i in range(values.size)
        for j in range(i)
        if known[i] or known[j]
    ]
    return Agreement(name, tuple(estimates), mean, float(max(apart)) if apart else None)


def _has_interval(std: float | None) -> bool:
    return std is not None and np.isfinite(std) and std > 0.0
