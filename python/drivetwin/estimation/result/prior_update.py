# SPDX-License-Identifier: MIT
"""Update of a linear estimate with prior knowledge, and its inverse (prior removal).

The estimates and their covariance are a normal distribution. A prior value ± σ is one more
measurement of one parameter; σ = 0 fixes it. The other parameters follow by their correlation.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.parameters import get_parameter_spec
from drivetwin.vehicle.spec import PriorValue


@dataclass(frozen=True)
class PriorSettings:
    """Limits of the comparison of log and design values."""

    contradiction: float = 3.0
    """Difference of log and design value from which a finding is due [standard deviations]."""
    min_information: float = 0.02
    """Share of the information on a parameter below which none is from the log [ratio]."""


PRIOR = PriorSettings()


def add_priors(
    ids: Sequence[str],
    values: FloatArray,
    covariance: FloatArray,
    known: Mapping[str, PriorValue],
) -> tuple[FloatArray, FloatArray, tuple[Finding, ...]]:
    """Update values (q,) and covariance (q, q) with the known values; return findings too.

    A finding is returned for each exactly known value that the log contradicts; prior_conflict.py
    checks the others.
    Known values of parameters that are not among `ids` change nothing.
    """
    values, covariance = values.copy(), covariance.copy()
    found: list[Finding] = []
    for name, prior in known.items():
        if name not in ids:
            continue
        k = ids.index(name)
        column, spread = covariance[:, k].copy(), covariance[k, k] + prior.std**2
        if spread <= 0.0:
            continue
        miss = prior.value - values[k]
        if prior.std == 0.0 and abs(miss) > PRIOR.contradiction * np.sqrt(spread):
            unit = get_parameter_spec(name).unit
            card, log = Number(prior.value, unit), Number(float(values[k]), unit)
            found.append(report(Code.FIXED_VALUE_CONTRADICTED, name, card=card, log=log))
        values = values + column * (miss / spread)
        covariance -= np.outer(column, column) / spread
        covariance[np.diag_indices_from(covariance)] = np.maximum(np.diag(covariance), 0.0)
    return values, covariance, tuple(found)


def remove_prior(
    values: FloatArray, covariance: FloatArray, k: int, prior: PriorValue
) -> tuple[FloatArray, FloatArray] | None:
    """Values (q,) and covariance (q, q) with the normal `prior` of number k taken out.

    None where the prior is exact or what is left would be next to nothing.
    """
    column, variance = covariance[:, k], float(covariance[k, k])
    if prior.std <= 0.0 or not np.isfinite(covariance).all() or variance <= 0.0:
        return None
    left = prior.std**2 - variance
    if left < PRIOR.min_information * prior.std**2:
        return None
    freed = covariance + np.outer(column, column) / left
    return values + column * ((values[k] - prior.value) / left), freed
