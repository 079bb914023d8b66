# SPDX-License-Identifier: MIT
"""Settings of all stages of the likelihood method, as the result records them."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from drivetwin.estimation import identification
from drivetwin.estimation.data import noise, segments, select_shifts
from drivetwin.estimation.direct import load_balance, momentum_balance
from drivetwin.estimation.likelihood import coloured_noise, objective, priors
from drivetwin.estimation.likelihood.data import input_smoothing, recorded_data
from drivetwin.estimation.likelihood.effects import causes, correction, joint_step
from drivetwin.estimation.likelihood.noise import residual_covariance
from drivetwin.estimation.likelihood.optimize import initial_guess, multistart, search
from drivetwin.estimation.optimize import gauss_newton
from drivetwin.estimation.result import prior_conflict, verdict

_STAGES = (
    *(noise, select_shifts, segments, momentum_balance, load_balance, initial_guess),
    *(recorded_data, input_smoothing, priors, multistart, search, gauss_newton, objective),
    *(residual_covariance, coloured_noise, causes, joint_step, correction),
    *(verdict, prior_conflict, identification),
)


def collect_settings() -> dict[str, Any]:
    """Collect the settings of the likelihood method by stage.

    The settings of a stage are the constants of its module whose class is named `...Settings`.
    """
    return {
        name.lower(): asdict(value)
        for stage in _STAGES
        for name, value in vars(stage).items()
        if type(value).__name__.endswith("Settings")
    }
