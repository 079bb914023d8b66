# SPDX-License-Identifier: MIT
"""Whether the load is constant over a shift: eq. 11 over it, with the vehicle of all shifts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from drivetwin.errors import IdentificationError
from drivetwin.identify.load import WIDTH
from drivetwin.identify.modulating import Quadrature, hann_kernels, join, windows_in
from drivetwin.identify.regression import Prior, Term, solve
from drivetwin.identify.signals import FloatArray, Sampled, Span
from drivetwin.shifts.recorded import parts_between

UNKNOWNS = 3
"""Load, inertia and the part of the load that grows with speed."""
AGREEING = 3
"""Fewest shifts of which most can be right."""


@dataclass(frozen=True)
class OwnLoad:
    """What eq. 11 says over one span: `left`, the noise power (1: noise alone) that the best load
    leaves; J3 [kg m^2] and the part of the load that grows with the square of the speed, at the
    output shaft [N m s^2/rad^2], with their standard deviations."""

    left: float
    J_vehicle: tuple[float, float]
    growth: tuple[float, float]


def own_load(
    torque: Sampled,
    wheel: Sampled,
    i_f: float,
    span: Span,
    vehicle: tuple[float, float] | None = None,
) -> OwnLoad | None:
    """Fit a load that is constant over `span` [s], but for what grows with the speed `wheel`.

    J3 and that growth too, unless the `vehicle` gives both: much more than noise is then left
    where something else moves it, a brake or a change of grade. By itself a shift would take a
    part of that for inertia. None where the span holds nothing to tell it from.
    """
    parts = parts_between(span, (*torque.unrecorded, *wheel.unrecorded))
    windows = join([windows_in(part, WIDTH, WIDTH / 4.0) for part in parts])
    if windows.count <= UNKNOWNS:
        return None
    psi = hann_kernels(torque.time, windows).psi
    kernels = hann_kernels(wheel.time, windows)
    area, one = 0.5 * windows.width, np.ones(windows.count)
    constant = Quadrature(csr_array(area[:, None]))
    square = (kernels.psi.matrix @ wheel.values**2) / area
    width = max(float(np.ptp(square)), np.finfo(float).tiny)
    grown = (square - square.mean()) / width

    def terms(theta: FloatArray) -> list[Term]:
        load = -(theta[0] + theta[2] * grown)
        inertia = {1: (-one / i_f, kernels.slope)}
        return [
            Term(torque.values, torque.sigma, psi, one, {}),
            Term(np.ones(1), 0.0, constant, load, {0: (-one, constant), 2: (-grown, constant)}),
            Term(wheel.values, wheel.sigma, kernels.slope, -theta[1] / i_f * one, inertia),
        ]

    start, prior = np.zeros(UNKNOWNS), Prior.independent(UNKNOWNS, {})
    if vehicle is not None:
        start[1:] = vehicle[0], vehicle[1] * width
        prior = prior.held(1, start[1]).held(2, start[2])
    try:
        fit = solve(terms, start, prior)
    except IdentificationError:
        return None
    std = fit.std
    growth = float(fit.theta[2]) / width, float(std[2]) / width
    return OwnLoad(fit.chi2, (float(fit.theta[1]), float(std[1])), growth)


def vehicle_of(loads: Sequence[OwnLoad]) -> tuple[float, float] | None:
    """J3 [kg m^2] and growth of the load [N m s^2/rad^2] that most of the shifts agree on.

    Medians weighted by information: a shift over which the load changes takes that for inertia or
    for growth, be it never so steady else. None where they are too few to say which of them does.
    """
    told = [one for one in loads if min(one.J_vehicle[1], one.growth[1]) > 0.0]
    if len(told) < AGREEING:
        return None
    return _median([one.J_vehicle for one in told]), _median([one.growth for one in told])


def _median(told: Sequence[tuple[float, float]]) -> float:
    """Median of values weighted by the inverse of their standard deviations."""
    value, std = np.array(sorted(told)).T
    share = np.cumsum(1.0 / std)
    return float(value[np.searchsorted(share, 0.5 * share[-1])])
