# SPDX-License-Identifier: MIT
"""Combinations of parameters that the measurements do not identify, and parameters at a bound.

A direction of the information matrix without priors along which all parameters may move by
several per cent at no cost is named by the parameters that make it up.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.parametrization import LAW
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.likelihood.covariance import report_null_directions
from drivetwin.parameters import get_parameter_spec

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
