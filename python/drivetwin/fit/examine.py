# SPDX-License-Identifier: MIT
"""Certainty of a fit: what would narrow its intervals, and profiles."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin.errors import InputError
from drivetwin.estimation.result.estimate import Z95
from drivetwin.fit.profile import hold_coordinate
from drivetwin.fit.result import ModelFit
from drivetwin.likelihood.covariance import (
    compute_covariance,
    invert_information,
    reduce_information,
)
from drivetwin.likelihood.profile import Profile, trace_profile

REPEATS = 4
"""Recordings in place of one that an improvement assumes."""


@dataclass(frozen=True)
class Improvement:
    """Half widths of the 95 % interval of an unknown [SI]: `now`, with `REPEATS` recordings like
    each, and with the number `known` exact, the unknown or fixed number that narrows it most; empty
    if none does."""

    unknown: str
    now: float
    repeated: float
    known: str
    then: float


def rank_improvements(found: ModelFit) -> tuple[Improvement, ...]:
    """Compute what would narrow the interval of each unknown.

    Repeated recordings have starts of their own; a number that is known exactly takes part no more.
    """
    names = [*(one.name for one in found.sought), *(one.number.name for one in found.moved)]
    every = range(len(found.minimum.point.names))
    rest = list(every)[len(found.sought) : len(every) - len(found.moved)]
    keep = [k for k in every if k not in rest]
    data = reduce_information(found.normal.data, keep, rest)
    prior = found.problem.prior.precision[np.ix_(keep, keep)]
    now = found.covariance[np.ix_(keep, keep)]
    noise = np.diag(now) / np.diag(invert_information(data + prior))
    repeated = noise * np.diag(invert_information(REPEATS * data + prior))
    improvements = []
    for k, one in enumerate(found.sought):
        scale = found.values[one.name] if one.is_positive else 1.0
        left = now[k, k] - now[k, :] ** 2 / np.diag(now)
        left[k] = now[k, k]
        best = int(np.argmin(left))
        known = "" if best == k else names[best]
        widths = Z95 * scale * np.sqrt(np.maximum([now[k, k], repeated[k], left[best]], 0.0))
        improvements.append(
            Improvement(one.name, float(widths[0]), float(widths[1]), known, float(widths[2]))
        )
    return tuple(improvements)


def compute_profile(found: ModelFit, unknown: str) -> Profile:
    """Compute the profile likelihood of an unknown.

    Parameters
    ----------
    found
        Fit.
    unknown
        Its name.

    Returns
    -------
    Profile
        Rise of Q over values in SI, with the 95 % interval by it.

    Raises
    ------
    InputError
        For a name that is no unknown of the fit.
    """
    names = [one.name for one in found.sought]
    if unknown not in names:
        raise InputError(f"the fit has no unknown {unknown!r}", f"choose one of {', '.join(names)}")
    one = found.sought[names.index(unknown)]
    covariance = compute_covariance(found.problem, found.normal, found.chi2)
    profile = trace_profile(hold_coordinate(found.minimum, covariance, names.index(unknown)))
    if not one.is_positive:
        return profile
    (low, high), (least, most) = profile.interval, profile.linear
    return replace(
        profile,
        values=np.exp(profile.values),
        estimate=one.to_value(profile.estimate),
        interval=(float(np.exp(low)), float(np.exp(high))),
        linear=(one.to_value(least), one.to_value(most)),
    )
