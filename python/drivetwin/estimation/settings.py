# SPDX-License-Identifier: MIT
"""Settings of all stages of a method, as the result records them."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from drivetwin.estimation import identification
from drivetwin.estimation.data import noise, segments, select_shifts
from drivetwin.estimation.likelihood import coloured_noise, objective, priors
from drivetwin.estimation.likelihood import pipeline as likelihood
from drivetwin.estimation.likelihood.data import input_smoothing, shift_record
from drivetwin.estimation.likelihood.effects import causes, correction, joint_step
from drivetwin.estimation.likelihood.noise import residual_covariance
from drivetwin.estimation.likelihood.optimize import (
    initial_guess,
    multistart,
)
from drivetwin.estimation.linear import (
    estimates,
    friction_points,
    load_balance,
    momentum_balance,
    ringdown,
)
from drivetwin.estimation.linear import pipeline as integral
from drivetwin.estimation.optimize import gauss_newton
from drivetwin.estimation.result import prior_conflict, verdict
from drivetwin.estimation.result.method import Method

_LINEAR = (
    *(noise, select_shifts, segments, momentum_balance, load_balance, ringdown, friction_points),
    *(integral, gauss_newton, estimates, verdict, prior_conflict),
)
"""Stages of the integral method, with which the likelihood method starts."""
_LIKELIHOOD = (
    *(likelihood, shift_record, input_smoothing, priors, initial_guess),
    *(multistart, objective, residual_covariance, coloured_noise),
    *(causes, joint_step, correction, identification),
)
"""Stages that the likelihood method adds."""


def collect_settings(method: Method) -> dict[str, Any]:
    """Collect the settings of the integral or the likelihood method by stage.

    The settings of a stage are the constants of its module whose class is named `...Settings`.
    """
    return {
        name.lower(): asdict(value)
        for stage in (_LINEAR if method is Method.INTEGRAL else _LINEAR + _LIKELIHOOD)
        for name, value in vars(stage).items()
        if type(value).__name__.endswith("Settings")
    }
