# SPDX-License-Identifier: MIT
"""Likelihood objective: residuals of all recordings, their weighting, the priors.

    Q(θ) = Σ_terms (y - ŷ(θ))ᵀ Σ⁻¹ (y - ŷ(θ)) + (θ - θ₀)ᵀ P₀⁻¹ (θ - θ₀)

ŷ is the output of the core, its derivatives are the core's, exact through lock and break-away. Σ
is held while θ moves.

Driven by the inputs as measured, ŷ and its derivatives carry the same input noise, and their
product has a mean: parameters that attenuate the noise (Jo′ before all) come out too large. So
the run is driven by the expected inputs û, the measured ones less the noise that the residual
shows, and what that takes off the residual, G·(u - û), is put back linearly. At the minimum this
is the joint maximum over parameters and inputs (total least squares as in
errors_in_variables.py).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Generic, Protocol, Self, TypeVar

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.likelihood.budget import (
    EXPANSION,
    RUN,
    WEIGHTING,
    charge,
)
from drivetwin.likelihood.output import Output
from drivetwin.likelihood.point import (
    NormalEquations,
    ParameterVector,
    Prior,
    find_acting,
    place_columns,
)
from drivetwin.likelihood.residual_covariance import Whitener
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.vehicle.spec import PriorValue


@dataclass(frozen=True)
class ObjectiveSettings:
    """Numerical limits of the objective."""

    max_residual: float = 1e9
    """Residual from which a run counts as failed [standard deviations]."""
    square_rtol: float = 1e-6
    """Tolerance for a negative sum of squares, over the squares in it [ratio]."""


OBJECTIVE = ObjectiveSettings()


class ComparedSamples(Protocol):
    """Compared samples of a term."""

    @property
    def time(self) -> FloatArray:
        """Grid of the simulation [s]."""

    @property
    def outputs(self) -> tuple[Output, ...]:
        """Compared signals, in the order in which residuals are stacked."""

    @property
    def size(self) -> int:
        """Number of compared samples."""

    @property
    def sigma(self) -> FloatArray:
        """Standard deviation of each compared sample (n,)."""


class Term(Protocol):
    """One recording: what was compared, its simulation, the weighting of its residuals."""

    @property
    def record(self) -> ComparedSamples:
        """Compared samples."""

    @property
    def weighting(self) -> Whitener:
        """Weighting of the residuals."""

    @property
    def label(self) -> str:
        """Name of the recording among several."""

    @property
    def inputs(self) -> Mapping[str, Signal]:
        """Measured inputs by the names of findings."""

    @property
    def speeds(self) -> list[str]:
        """Names of the compared speeds."""

    def evaluate(self, point: ParameterVector) -> FloatArray | None:
        """Compute the residual (n,) at `point`; None if the simulation fails."""

    def linearise(self, point: ParameterVector) -> tuple[FloatArray, FloatArray] | None:
        """Compute the residual (n,) and the derivative (n, p) of the simulated samples by
        `point`; None if the simulation fails."""

    def update_weighting(self, point: ParameterVector) -> Self:
        """Compute the covariance of output and input noise at `point`."""

    def update_inputs(self, point: ParameterVector) -> Self:
        """Subtract the expected input noise at `point` from the inputs, and compute the weighting
        there."""


T = TypeVar("T", bound=Term)


@dataclass(frozen=True, eq=False)
class LikelihoodObjective(Generic[T]):
    """Likelihood of all terms, with prior and bounds `lower`, `upper` (p,) of their unknowns.

    `reach` is the largest change of an unknown in one step.
    """

    terms: tuple[T, ...]
    prior: Prior
    lower: FloatArray
    upper: FloatArray
    reach: FloatArray | float = np.inf

    def extend(
        self, terms: Sequence[T], priors: Sequence[PriorValue], reach: float
    ) -> LikelihoodObjective[T]:
        """Add unknowns with `priors`, which come last, and of which the `terms` are functions.

        They stay within `reach` standard deviations of their prior, as each step does.
        """
        prior = self.prior
        for one in priors:
            prior = prior.append(one.value, one.std)
        mean, std = np.array([(one.value, one.std) for one in priors]).T
        return LikelihoodObjective(
            tuple(terms),
            prior,
            np.append(self.lower, mean - reach * std),
            np.append(self.upper, mean + reach * std),
            np.append(np.broadcast_to(self.reach, self.lower.shape), reach * std),
        )

    @property
    def size(self) -> int:
        """Number of compared samples."""
        return sum(term.record.size for term in self.terms)

    @property
    def log_determinant(self) -> float:
        """log|Σ| of the weighting of all terms."""
        return sum(term.weighting.log_determinant for term in self.terms)

    def update_weighting(self, point: ParameterVector) -> Self:
        """Compute the covariance with input noise at `point`."""
        charge(WEIGHTING)
        terms = tuple(term.update_weighting(point) for term in self.terms)
        return replace(self, terms=terms, prior=self.prior.linearise(point.values))

    def update_inputs(self, point: ParameterVector) -> Self:
        """Drive the problem by the expected inputs at `point`, weighted there."""
        return replace(self, terms=tuple(term.update_inputs(point) for term in self.terms))

    def cost(self, point: ParameterVector) -> float:
        """Compute Q; infinite if a simulation fails or Q is not a sum of squares."""
        charge(RUN)
        total = self.prior.compute_prior_cost(point.values)
        for term in self.terms:
            residual = term.evaluate(point)
            if residual is None:
                return float("inf")
            with np.errstate(over="ignore", invalid="ignore"):
                square = float(residual @ term.weighting.apply_inverse(residual))
            if not _is_square(square):
                return float("inf")
            total += square
        return total

    def retract(self, point: ParameterVector, step: FloatArray) -> FloatArray:
        """Compute the values (p,) after a `step` (p,), which is cut at the reach."""
        return np.asarray(point.values + np.clip(step, -self.reach, self.reach))

    def compute_curvature(
        self, point: ParameterVector, normal: NormalEquations, step: FloatArray, share: float
    ) -> FloatArray | None:
        """Compute Jᵀ Σ⁻¹ y'' (p,) of the simulated samples y along a `step` (p,), from those after
        a `share` of it; None if a simulation fails."""
        charge(RUN)
        near = point.replace_values(point.values + share * step)
        total = np.zeros(step.size)
        terms = zip(self.terms, normal.residuals, normal.slopes, normal.regressors, strict=True)
        for term, residual, slopes, regressors in terms:
            there = term.evaluate(near)
            if there is None:
                return None
            bend = (residual - there) / share - slopes @ step
            total += regressors.T @ (2.0 / share * bend)
        return total

    def normal(self, point: ParameterVector) -> NormalEquations | None:
        """Compute the expansion of Q at `point`; None if a simulation fails."""
        size = len(point.names)
        charge(EXPANSION)
        cost, gradient = (
            self.prior.compute_prior_cost(point.values),
            self.prior.compute_gradient(point.values),
        )
        data = np.zeros((size, size))
        residuals, regressors, every = [], [], []
        for term in self.terms:
            found = term.linearise(point)
            if found is None:
                return None
            residual, slopes = found
            acting = find_acting(slopes)
            own = slopes[:, acting]
            with np.errstate(over="ignore", invalid="ignore"):
                weighted = term.weighting.apply_inverse(np.column_stack([residual, own]))
                square = float(residual @ weighted[:, 0])
                gradient[acting] -= own.T @ weighted[:, 0]
                data[np.ix_(acting, acting)] += own.T @ weighted[:, 1:]
            if not _is_square(square):
                return None
            cost += square
            residuals.append(residual)
            regressors.append(place_columns(weighted[:, 1:], acting, size))
            every.append(place_columns(own, acting, size))
        data = 0.5 * (data + data.T)
        if not (np.all(np.isfinite(data)) and _is_semidefinite(data)):
            return None
        information = data + self.prior.precision
        return NormalEquations(
            cost, gradient, information, data, tuple(residuals), tuple(regressors), tuple(every)
        )


def _is_square(value: float) -> bool:
    """Return whether a sum of squares is finite and not negative.

    It is negative if the weighting has lost its digits to inputs so coarse that their noise
    explains everything.
    """
    return bool(np.isfinite(value)) and value >= 0.0


def _is_semidefinite(data: FloatArray) -> bool:
    """Return whether a matrix can be one of weighted scalar products of slopes.

    A weighting that has lost its digits gives some directions a negative length.
    """
    squares = np.diag(data)
    if np.any(squares < 0.0):
        return False
    length = np.sqrt(np.where(squares > 0.0, squares, 1.0))
    return bool(np.linalg.eigvalsh(data / np.outer(length, length))[0] > -OBJECTIVE.square_rtol)
