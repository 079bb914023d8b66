# SPDX-License-Identifier: MIT
"""Estimates of friction and fill pressure without the card's design prior.

A design prior pulls the estimate of every log in the same direction: averaged over a fleet it would
count once for each log and hide ageing. It is therefore removed before joint estimation.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.parametrization import LAW
from drivetwin.estimation.linear.friction_points import P0, evaluate_stribeck
from drivetwin.estimation.result.prior_conflict import remove_prior
from drivetwin.vehicle.vehicle_card import VehicleCard

_LAW_SIZE = P0


@dataclass(frozen=True)
class FreeFriction:
    """μ at a slip, and P0 [Pa], with their standard deviations, of the log alone."""

    mu: float
    mu_std: float
    P0: float
    P0_std: float


def remove_friction_prior(
    found: Identification, card: VehicleCard, element: str, slip: float
) -> FreeFriction | None:
    """Friction at `slip` [rad/s] and P0 of an element without the card's prior of P0.

    None if the method yields no covariance of the two, or the log has no data on P0 itself.
    """
    posterior = _get_posterior(found, element)
    if posterior is None:
        return None
    theta, covariance = posterior
    mu, slopes = evaluate_stribeck(theta, np.array([slip]))
    to_pair = np.zeros((2, _LAW_SIZE + 1))
    to_pair[0, :_LAW_SIZE] = slopes[:, 0]
    to_pair[1, P0] = 1.0
    pair = np.array([float(mu[0]), theta[P0]])
    prior = card.elements[element].P0
    freed = remove_prior(pair, to_pair @ covariance @ to_pair.T, 1, prior)
    if freed is None:
        return None
    values, spread = freed
    stds = np.sqrt(np.diag(spread))
    return FreeFriction(float(values[0]), float(stds[0]), float(values[1]), float(stds[1]))


def _get_posterior(found: Identification, element: str) -> tuple[FloatArray, FloatArray] | None:
    """Friction law and P0 (5,) of an element, and their covariance, by either linear method."""
    fit = found.evidence.likelihood
    if fit is not None:
        wanted = [f"{element}.{key}" for key in (*LAW, "P0")]
        if not set(wanted) <= set(fit.point.names):
            return None
        place = [fit.point.names.index(name) for name in wanted]
        return fit.mean.values[place], fit.covariance[np.ix_(place, place)]
    for shift in found.evidence.integral:
        if shift.friction is not None and shift.friction.element == element:
            size = _LAW_SIZE + 1
            return shift.friction.fit.theta[:size], shift.friction.fit.covariance[:size, :size]
    return None
