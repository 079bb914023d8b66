# SPDX-License-Identifier: MIT
"""Minimum of the likelihood of shifts: covariance, unidentified directions, bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.parametrization import LAW, DualClutchProblem
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.likelihood.budget import limit_evaluations
from drivetwin.likelihood.covariance import (
    compute_covariance,
    invert_information,
    report_null_directions,
)
from drivetwin.likelihood.point import NormalEquations, ParameterVector
from drivetwin.parameters import get_parameter_spec
from drivetwin.vehicle.effects import EffectId


@dataclass(frozen=True, eq=False)
class PlantEvidence:
    """Evidence of the element that the plant of a fit has beside the dual clutch.

    `nats` is the log evidence against the dual clutch alone, `moves` (p,) are those of the unknowns
    from its minimum, `index` is that of the logarithm of the size among them.
    """

    effect: EffectId
    nats: float
    moves: FloatArray
    index: int


@dataclass(frozen=True, eq=False)
class LikelihoodFit:
    """Minimum of Q at `point` with the covariance (p, p) of the unknowns.

    `chi2` is Q per sample less the prior; `problem` holds the weighting at the minimum and `normal`
    the expansion of Q there. The covariance is that of `compute_covariance`. `plant` describes the
    element beside the dual clutch; its unknowns come last, that of the size first.
    """

    problem: DualClutchProblem
    point: ParameterVector
    covariance: FloatArray
    normal: NormalEquations
    chi2: float
    iterations: int
    plant: PlantEvidence | None = None

    @cached_property
    def deviance(self) -> float:
        """Q + log|Σ|: -2 log of likelihood times prior, up to a constant of the samples.

        Σ is computed anew at the minimum: that of the search is of the point before, where noise
        about P0 opened an element at other instants, and log|Σ| was another by up to a thousand.
        It is no part of a search and counts as no work.
        """
        with limit_evaluations(np.inf):
            anew = self.problem.update_weighting(self.point)
            return anew.cost(self.point) + anew.log_determinant

    @cached_property
    def noise_covariance(self) -> FloatArray:
        """Covariance (p, p) of the unknowns from noise and slow errors."""
        return compute_covariance(self.problem, self.normal, self.chi2)


def compute_variance_inflation(fit: LikelihoodFit, rows: FloatArray) -> float:
    """Compute the ratio of residual power, slow errors included, to sensor noise: the mean over
    the independent directions of the unknowns that `rows` (k, p) span."""
    covariance = rows @ invert_information(fit.normal.information) @ rows.T
    spread = rows @ fit.noise_covariance @ rows.T
    scale = np.sqrt(np.outer(np.diag(covariance), np.diag(covariance)))
    inverse = np.linalg.pinv(covariance / scale, hermitian=True)
    return float(np.sum(inverse * (spread / scale))) / len(rows)


BOUND_STD = 1e-3
"""Distance from a bound, in standard deviations, within which an unknown stands on it."""
NAMED = ("eta", "J_e", "J_out", "J_vehicle", "Tv_over_if", "k_o", "c_o", "mu_c", "P0", "drum")
SHOWN = {"eta": "η", "J_e": "J′", "J_out": "Jo′", "J_vehicle": "J3", "Tv_over_if": "T_v"}

_CARD = "the design values of the vehicle card"


def find_null_directions(fit: LikelihoodFit) -> list[Finding]:
    """Return a finding for each direction that is not identifiable without the priors."""
    names = fit.point.names
    shown = {k: _format_unknown(name) for k, name in enumerate(names) if _is_reported(name, names)}
    return report_null_directions(fit.normal.data, np.abs(fit.point.values), shown, _CARD)


def _is_reported(name: str, names: Sequence[str]) -> bool:
    """Return whether an unknown is reported; μ only of elements whose whole law is free."""
    element, _, key = name.rpartition(".")
    return key in NAMED and (key != LAW[0] or f"{element}.{LAW[-1]}" in names)


def _format_unknown(name: str) -> str:
    element, _, key = name.rpartition(".")
    symbol = SHOWN.get(key, {"mu_c": "μ", "drum": "drum inertia"}.get(key, key))
    return f"{symbol} of {element}" if element else symbol


def find_at_bounds(fit: LikelihoodFit, ids: Sequence[str], slopes: FloatArray) -> list[Finding]:
    """Return a finding for each parameter that is an unknown on one of its bounds.

    `slopes` (q, p) is the derivative of the parameters `ids` by the unknowns of the fit.
    """
    values, (below, above) = fit.point.values, locate_bounds(fit)
    found = []
    for name, row in zip(ids, slopes, strict=True):
        (acting,) = np.nonzero(row)
        if acting.size != 1 or not (below | above)[acting[0]]:
            continue
        side = "larger" if above[acting[0]] else "smaller"
        limit = Number(float(values[acting[0]]), get_parameter_spec(name).unit)
        found.append(report(Code.AT_BOUND, name, limit=limit, side=side))
    return found


def is_at_bound(fit: LikelihoodFit, corrected: FloatArray) -> bool:
    """Return whether an unknown is on a bound: at the minimum, or with its `corrected` value (p,).

    The other unknowns then compensate for it, so that no entry of the card can be accused.
    """
    problem = fit.problem
    clipped = (corrected <= problem.lower) | (corrected >= problem.upper)
    return bool(np.any(np.logical_or(*locate_bounds(fit)) | clipped))


def locate_bounds(fit: LikelihoodFit) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Locate the unknowns on their lower and upper bounds, both (p,)."""
    values, near = fit.point.values, BOUND_STD * np.sqrt(np.diag(fit.covariance))
    return values <= fit.problem.lower + near, values >= fit.problem.upper - near
