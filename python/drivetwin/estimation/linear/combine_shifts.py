# SPDX-License-Identifier: MIT
"""Several shifts of one log: one value per parameter, weighted by covariance.

On a hilly road each shift has a load of its own, and T_v/i_f is their mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtri

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.linear.load_balance import is_common_load
from drivetwin.estimation.linear.pipeline import NUISANCES, IntegralShift

LOAD = "Tv_over_if"
"""Id of the load; on a hilly road each shift has its own, with its number appended after `@`."""


@dataclass(frozen=True)
class CombinationSettings:
    """Settings of the combination of the estimates of several shifts."""

    nugget: float = 1e-7
    """Variance by which parameters may leave an equation between them, as a share of their own
    [ratio]; without it their covariance is singular."""
    min_agreement: float = 1e-3
    """Probability of the scatter of the shifts below which an interval is widened to it
    [probability]."""


COMBINATION = CombinationSettings()


SHAFT = ("k_o", "c_o", "f_d_", "zeta_")
"""Prefixes of parameters derived from ring-down and inertias by nonlinear equations. Each shift
linearises them about its own values. The linearisations of two shifts differ to second order (the
square of a relative standard deviation), so combined values may violate the equations by as much.
"""


def merge_shifts(
    shifts: Sequence[IntegralShift],
) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """Generalised least squares over the shifts' estimates: ids, values (q,), covariance (q, q).

    A prior is in the estimate of every shift with its parameter but counts once: its information
    is taken out for all of them but the first. Nuisances that the shifts share are eliminated last.
    """
    ids, values, covariance = _merge_separate_loads(shifts) or _join_shifts(shifts)
    kept = [k for k, name in enumerate(ids) if name.split(".")[0] not in NUISANCES]
    ids, values = tuple(ids[k] for k in kept), values[kept]
    wider = np.array(
        [_estimate_scatter(name, value, shifts) for name, value in zip(ids, values, strict=True)]
    )
    return ids, values, covariance[np.ix_(kept, kept)] * np.outer(wider, wider)


def _estimate_scatter(name: str, value: float, shifts: Sequence[IntegralShift]) -> float:
    """Factor by which the shifts lie further about a value than their noise explains; 1 if it does.

    What a shift alone has, and the load, which may be a shift's own, have none.
    """
    deviations = [
        (shift.values[k] - value) / np.sqrt(shift.covariance[k, k])
        for shift in shifts
        if name in shift.ids and name != LOAD
        for k in (shift.ids.index(name),)
    ]
    square, freedom = float(np.sum(np.square(deviations))), len(deviations) - 1
    if freedom < 1 or square < chdtri(freedom, COMBINATION.min_agreement):
        return 1.0
    return float(np.sqrt(square / freedom))


def collect_different_loads(shifts: Sequence[IntegralShift]) -> tuple[float, ...]:
    """Load of each shift at the output shaft [N m] where they differ; else empty."""
    return tuple(shift.load.load for shift in shifts) if _merge_separate_loads(shifts) else ()


def _merge_separate_loads(
    shifts: Sequence[IntegralShift],
) -> tuple[tuple[str, ...], FloatArray, FloatArray] | None:
    """Combine the shifts with one load each and report the mean load; None if one load suffices."""
    if len(shifts) == 1 or not all(LOAD in shift.ids for shift in shifts):
        return None
    own = [
        replace(shift, ids=tuple(f"{n}@{k}" if n == LOAD else n for n in shift.ids))
        for k, shift in enumerate(shifts)
    ]
    ids, values, covariance = _join_shifts(own)
    first, *others = [ids.index(f"{LOAD}@{k}") for k in range(len(shifts))]
    rows, loads = np.eye(len(ids)), [first, *others]
    if is_common_load(values[loads], covariance[np.ix_(loads, loads)]):
        return None
    rows[first, [first, *others]] = 1.0 / len(shifts)
    kept = [k for k in range(len(ids)) if k not in others]
    rows = rows[kept]
    names = tuple(LOAD if k == first else ids[k] for k in kept)
    return names, rows @ values, rows @ covariance @ rows.T


def _compute_loose_variances(shift: IntegralShift) -> FloatArray:
    """Variances (q,) by which its parameters may leave the equations between them, as shares."""
    bent = [name.startswith(SHAFT) for name in shift.ids]
    relative = np.diag(shift.covariance) / np.square(shift.values)
    return np.where(bent, np.maximum(relative, COMBINATION.nugget), COMBINATION.nugget)


def _join_shifts(
    shifts: Sequence[IntegralShift],
) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    if len(shifts) == 1:
        return shifts[0].ids, shifts[0].values, shifts[0].covariance
    ids = tuple(dict.fromkeys(name for shift in shifts for name in shift.ids))
    information = np.zeros((len(ids), len(ids)))
    pull = np.zeros(len(ids))
    scale = np.ones(len(ids))
    for shift in shifts:
        place = [ids.index(name) for name in shift.ids]
        scale[place] = np.sqrt(np.diag(shift.covariance))
    for shift in shifts:
        place = [ids.index(name) for name in shift.ids]
        unit = scale[place]
        weight = np.linalg.inv(
            shift.covariance / np.outer(unit, unit) + np.diag(_compute_loose_variances(shift))
        )
        information[np.ix_(place, place)] += weight
        pull[place] += weight @ (shift.values / unit)
    for name, prior in {n: p for shift in shifts for n, p in shift.priors.items()}.items():
        if prior.std > 0.0:
            k, times = ids.index(name), sum(name in shift.priors for shift in shifts)
            surplus = (times - 1) * (scale[k] / prior.std) ** 2
            information[k, k] -= surplus
            pull[k] -= surplus * prior.value / scale[k]
    covariance = np.linalg.inv(information)
    return ids, (covariance @ pull) * scale, covariance * np.outer(scale, scale)
