# SPDX-License-Identifier: MIT
"""Ratios of the vehicle card against the speeds of a log, before an identification."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin.estimation.data.prepare import measure_ratios
from drivetwin.estimation.data.shift_data import ShiftData
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.estimation.result.prior_conflict import report_refined
from drivetwin.findings import Finding
from drivetwin.parameters import FINAL_DRIVE
from drivetwin.vehicle.spec import PriorValue

METHOD = "speeds"
"""Method of a ratio that is no result of a fit."""


def compare_ratios(shifts: Sequence[ShiftData], final_drive: PriorValue | None) -> list[Finding]:
    """Report each ratio on the card that the speeds of the log know better.

    The findings are those of an identification by the likelihood. Ratios of gears are those of mean
    speeds, averaged over the shifts by their precision. `final_drive` is that of the log: the mean
    speeds of a shift contain the twist of the shaft.
    """
    priors: dict[str, PriorValue] = {}
    measured: dict[str, list[PriorValue]] = {}
    for shift in shifts:
        priors |= shift.driveline.ratio_priors
        for name, one in measure_ratios(shift.signals, shift.driveline).items():
            measured.setdefault(name, []).append(one)
    measured.pop(FINAL_DRIVE, None)
    if final_drive is not None:
        measured[FINAL_DRIVE] = [final_drive]
    estimates = {name: _average(name, values) for name, values in measured.items()}
    return report_refined(priors, estimates)


def _average(name: str, values: Sequence[PriorValue]) -> Estimate:
    """Average independent values of one ratio by their precision."""
    value, std = np.array([(one.value, one.std) for one in values]).T
    weights = std**-2.0 if np.all(std > 0.0) else np.ones(len(values))
    mean = float(np.average(value, weights=weights))
    spread = float(np.sum(weights) ** -0.5) if np.all(std > 0.0) else 0.0
    return Estimate(name, mean, spread, Verdict.IDENTIFIED, METHOD)
