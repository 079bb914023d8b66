# SPDX-License-Identifier: MIT
"""Starting values: values of the linear method after a failed likelihood.

Their intervals contain noise alone. They hold only where the simulation with them explains the log.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.cause import EXPLAINED
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.estimation.result.validation import Validation
from drivetwin.findings import Code, explain


def withhold_starting_values(found: Identification) -> Identification:
    """Withhold the values of an identification whose likelihood failed, with their friction.

    They are kept where the simulation with them leaves the noise of every compared signal and no
    more. Values of the card stay.
    """
    if not found.evidence.gave_up:
        return found
    chi2, channel = _find_largest_power(found)
    if chi2 <= EXPLAINED:
        return found
    reason = explain(Code.STARTING_VALUE_UNCHECKED)
    if channel:
        reason = explain(Code.STARTING_VALUE, chi2=chi2, channel=channel)
    estimates = {name: _withhold(one, reason) for name, one in found.estimates.items()}
    return replace(found, estimates=estimates, friction={}, joint=None)


def _withhold(one: Estimate, reason: str) -> Estimate:
    if one.verdict not in (Verdict.IDENTIFIED, Verdict.WEAK):
        return one
    return Estimate(one.id, None, None, Verdict.NOT_IDENTIFIABLE, one.method, reason=reason)


def _find_largest_power(found: Identification) -> tuple[float, str]:
    """Find the largest residual power of a compared signal over its noise, and the signal; infinite
    without a simulation."""
    worst = float("inf"), ""
    powers = [
        (power, name.replace("_", " "))
        for one, signals in zip(found.evidence.validation, found.evidence.signals, strict=False)
        for name, power in _compute_powers(one, signals).items()
    ]
    return max(powers, default=worst)


def _compute_powers(one: Validation, signals: ShiftSignals) -> dict[str, float]:
    """Compute the residual power of each compared signal over the power of its noise."""
    noise = {
        "output_torque": signals.output_torque.sigma,
        "input_speed": signals.engine_speed.sigma / one.model.i_in,
        "output_speed": signals.output_speed.sigma,
    }
    return {
        name: float(np.mean((trace.measured - trace.simulated) ** 2))
        / max(noise[name], 1e-300) ** 2
        for name, trace in one.traces.items()
        if trace.time.size
    }
