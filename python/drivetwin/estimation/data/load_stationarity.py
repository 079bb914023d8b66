# SPDX-License-Identifier: MIT
"""Stationarity of the load over a shift: residual of eq. 11 with a common vehicle inertia."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import Span
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.estimation.data.vehicle_balance import (
    GROWTH,
    INERTIA,
    WIDTH,
    VehicleBalance,
    build_recorded_windows,
)
from drivetwin.estimation.regression.errors_in_variables import Prior

UNKNOWNS = 3
"""Load, inertia and the part of the load that grows with speed."""
AGREEING = 3
"""Fewest shifts of which most can be right."""


@dataclass(frozen=True)
class ConstantLoadFit:
    """Constant-load fit of eq. 11 over one span.

    `left` is the residual noise power of the best load (1: noise alone). J3 [kg m^2] and the part
    of the load that grows with the square of the speed, at the output shaft [N m s^2/rad^2], have
    their standard deviations.
    """

    left: float
    J_vehicle: tuple[float, float]
    growth: tuple[float, float]


def fit_constant_load(
    torque: MeasuredSignal,
    wheel: MeasuredSignal,
    i_f: float,
    span: Span,
    vehicle: tuple[float, float] | None = None,
) -> ConstantLoadFit | None:
    """Fit a load over `span` [s] that is constant except for its growth with the speed `wheel`.

    J3 and the growth are fitted too, unless `vehicle` gives both. With both given, a brake or a
    change of grade leaves residuals well above the noise; a single shift with free J3 would assign
    part of them to the inertia. Returns None if the data do not determine the load.
    """
    windows = build_recorded_windows(torque, wheel, (span,), WIDTH / 4.0)
    if windows.count <= UNKNOWNS:
        return None
    balance = VehicleBalance.from_torque(torque, wheel, (1.0, i_f), windows)
    square = balance.square
    width = max(float(np.ptp(square)), np.finfo(float).tiny)
    grown = (square - square.mean()) / width
    start, prior = np.zeros(UNKNOWNS), Prior.from_independent(UNKNOWNS, {})
    if vehicle is not None:
        start[1:] = vehicle[0], vehicle[1] * width
        prior = prior.fix_parameter(INERTIA, start[INERTIA]).fix_parameter(GROWTH, start[GROWTH])
    try:
        fit = balance.solve_load(grown, start, prior)
    except IdentificationError:
        return None
    std = fit.std
    growth = float(fit.theta[GROWTH]) / width, float(std[GROWTH]) / width
    return ConstantLoadFit(fit.chi2, (float(fit.theta[INERTIA]), float(std[INERTIA])), growth)


def estimate_common_vehicle(loads: Sequence[ConstantLoadFit]) -> tuple[float, float] | None:
    """Estimate J3 [kg m^2] and the growth of the load [N m s^2/rad^2] common to most shifts.

    Both are medians weighted by information, because a change of load during a shift biases J3 or
    the growth of this shift. Returns None if there are too few shifts for a median.
    """
    told = [one for one in loads if min(one.J_vehicle[1], one.growth[1]) > 0.0]
    if len(told) < AGREEING:
        return None
    return _compute_weighted_median([one.J_vehicle for one in told]), _compute_weighted_median(
        [one.growth for one in told]
    )


def _compute_weighted_median(told: Sequence[tuple[float, float]]) -> float:
    """Median of values weighted by the inverse of their standard deviations."""
    value, std = np.array(sorted(told)).T
    share = np.cumsum(1.0 / std)
    return float(value[np.searchsorted(share, 0.5 * share[-1])])
