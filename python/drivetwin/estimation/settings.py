# SPDX-License-Identifier: MIT
"""Settings of all stages of the likelihood method, as the result records them."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from drivetwin.estimation import identification
from drivetwin.estimation.data import segments, select_shifts
from drivetwin.estimation.direct import load_balance, momentum_balance
from drivetwin.estimation.likelihood import initial_guess, multistart, priors
from drivetwin.estimation.likelihood.effects import causes, correction, joint_step
from drivetwin.estimation.result import prior_conflict, verdict
from drivetwin.likelihood import (
    coloured_noise,
    gauss_newton,
    input_smoothing,
    measured_signal,
    objective,
    recorded_data,
    residual_covariance,
    search,
)

_STAGES = (
    *(measured_signal, select_shifts, segments, momentum_balance, load_balance, initial_guess),
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
