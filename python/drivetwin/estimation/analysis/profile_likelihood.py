# SPDX-License-Identifier: MIT
"""Profile likelihood of one parameter: minimum of Q over all others while it is fixed.

    Q_p(v) = min over θ with q(θ) = v of Q(θ)

The interval from Q_p - Q_min = 3.84 needs no linearity, unlike the one from the covariance; where
the two differ, the profile is right. Between neighbouring values the search goes on from the last
point; its steps obey q(θ) = v by a Lagrange multiplier.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import IdentificationError, InputError
from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.fit import LikelihoodFit, compute_variance_inflation
from drivetwin.estimation.likelihood.uncertainty.derived_parameters import (
    compute_jacobian,
    compute_parameters,
)
from drivetwin.likelihood.budget import REMEDY
from drivetwin.likelihood.point import ParameterVector
from drivetwin.likelihood.profile import HeldParameter, Profile, trace_profile


def compute_profile(found: Identification, parameter: str) -> Profile:
    """Compute the profile of a parameter of a likelihood identification.

    Raises InputError for a parameter that the fit does not have or that is known from design, and
    IdentificationError where the identification is by another method.
    """
    fit, signals = get_likelihood_fit(found)
    values = compute_parameters(fit.problem, fit.point, signals)
    if parameter not in values:
        raise InputError(
            f"the fit has no parameter {parameter!r}", f"choose one of {', '.join(values)}"
        )
    held = _hold_reported(fit, signals, list(values).index(parameter), parameter)
    if held.std == 0.0:
        raise InputError(
            f"{parameter} is fixed by design",
            "give it a standard deviation on the vehicle card, or choose another",
        )
    return trace_profile(held)


def get_likelihood_fit(found: Identification) -> tuple[LikelihoodFit, Sequence[ShiftSignals]]:
    """Return the fit behind an identification and its signals.

    Raises IdentificationError for another method, or if the likelihood method did not converge.
    """
    fit, gave_up = found.evidence.likelihood, found.evidence.gave_up
    if fit is None and gave_up:
        raise IdentificationError(
            f"the likelihood fit of this log failed, so it has no profile: {gave_up}",
            REMEDY,
        )
    if fit is None:
        raise IdentificationError(
            f"the {found.method} method has no likelihood to work on",
            "identify with --method likelihood",
        )
    return fit, found.evidence.signals


def _hold_reported(
    fit: LikelihoodFit, signals: Sequence[ShiftSignals], place: int, parameter: str
) -> HeldParameter:
    """Hold a reported parameter of a fit, by its place among them and its name."""
    spread = np.sqrt(np.diag(fit.covariance))

    def compute_value(point: ParameterVector) -> float:
        return list(compute_parameters(fit.problem, point, signals).values())[place]

    def compute_gradient(point: ParameterVector) -> FloatArray:
        return np.asarray(compute_jacobian(fit.problem, point, spread, signals)[place])

    row = compute_gradient(fit.point)
    std = float(np.sqrt(max(float(row @ fit.covariance @ row), 0.0)))
    return HeldParameter(
        parameter,
        fit.problem,
        fit.point,
        fit.normal.cost,
        compute_value(fit.point),
        std,
        # Noise that is louder or slower than the sensors' shows the parameter less.
        compute_variance_inflation(fit, row[None, :]) if std > 0.0 else 1.0,
        compute_value,
        compute_gradient,
    )
