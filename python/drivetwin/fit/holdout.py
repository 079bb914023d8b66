# SPDX-License-Identifier: MIT
"""Hold-out of a fit: prediction of recordings that took no part in it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivetwin.errors import IdentificationError
from drivetwin.estimation.optimize.gauss_newton import minimise
from drivetwin.estimation.result.estimate import SignalFit
from drivetwin.fit.fit import build_problem
from drivetwin.fit.recording import Recording
from drivetwin.fit.result import ModelFit

_HELD = 1e-4
"""Spread of the unknowns in a prediction over that of the fit [ratio]: only starts move."""


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Prediction of one recording by the values of a fit: agreement by output, Q per sample by the
    sensors' noise and that of the inputs."""

    agreement: Mapping[str, SignalFit]
    chi2: float


def predict(found: ModelFit, recordings: Sequence[Recording]) -> tuple[HeldOut, ...]:
    """Predict recordings with the values of a fit; only their starts are adapted.

    Parameters
    ----------
    found
        Fit.
    recordings
        Recordings that took no part in it.

    Returns
    -------
    tuple of HeldOut
        Predictions in the order of the recordings.

    Raises
    ------
    IdentificationError
        Where a recording cannot be simulated.
    """
    held = []
    for recording in recordings:
        problem, point, sought = build_problem(found.fitted, [recording])
        count = len(sought)
        mean, precision = problem.prior.mean.copy(), problem.prior.precision.copy()
        mean[:count] = found.minimum.point.values[:count]
        spread = np.sqrt(np.diag(found.covariance)[:count])
        precision[:count, :count] = np.diag((_HELD * spread) ** -2.0)
        values = np.concatenate([mean[:count], point.values[count:]])
        prior = replace(problem.prior, mean=mean, precision=precision)
        problem, point = replace(problem, prior=prior), point.replace_values(values)
        rough = minimise(problem, point, rough=True)
        end = rough and minimise(problem.update_weighting(rough.point), rough.point)
        if not end:
            raise IdentificationError(
                "a recording that was held out cannot be simulated with the values of the fit",
                "check that it is of the same driveline, and its start",
            )
        part = end.problem.parts[0]
        cost = end.normal.cost - prior.compute_prior_cost(end.point.values)
        held.append(HeldOut(part.compare(end.point), cost / end.problem.size))
    return tuple(held)
