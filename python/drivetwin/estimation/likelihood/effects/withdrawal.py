# SPDX-License-Identifier: MIT
"""Withdrawal of the verdict `identified` where the correction for effects is unreliable."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.effects.correction import Correction
from drivetwin.estimation.likelihood.effects.effect import Group
from drivetwin.estimation.likelihood.effects.table import describe_group
from drivetwin.vehicle.effects import EffectId


@dataclass(frozen=True)
class WithdrawalSettings:
    """Limits beyond which a corrected value does not count as identified."""

    sizes: float = 3.0
    """Amount of an effect in stated prior standard deviations beyond which the prior is refuted,
    so that the interval of what the effect moves is too."""
    moves: float = 1.0
    """Move of a value by such an effect, in its standard deviations, that makes it unreliable."""
    second_step: float = 1.5
    """Move of a value by the second step, in its standard deviations, from which the effects are
    not linear: a third step would move it again."""
    chi2: float = 1.1
    """Residual power per sample after the correction above which something is missing from the
    model that no effect describes."""


WITHDRAWAL = WithdrawalSettings()
EXEMPT = (EffectId.FRICTION_SHAPE, EffectId.SENSOR_TOLERANCE)
"""Effects whose amounts may be large: shapes have no usual size, tolerances are the card's."""


def find_unreliable(correction: Correction, jacobian: FloatArray, std: FloatArray) -> list[str]:
    """Return the reason why each value is not to be relied on; empty where it is.

    Parameters
    ----------
    jacobian : derivatives (k, p) of the values by the unknowns of the fit
    std : total standard deviations (k,) of the values
    """
    if correction.step.chi2 > WITHDRAWAL.chi2:
        why = f"the residual is {correction.step.chi2:.2g} times the noise with all known effects"
        return [why] * std.size
    second = np.abs(jacobian @ np.nan_to_num(correction.second, posinf=np.inf))
    if not np.all(np.isfinite(correction.second)):
        second = np.full(std.size, np.inf)
    reasons = ["" for _ in std]
    for k in np.flatnonzero(second > WITHDRAWAL.second_step * std):
        reasons[k] = "the effects that the log shows are too large for a linear correction"
    for group in find_large_groups(correction):
        moves = np.abs(jacobian @ correction.step.contributions[group])
        for k in np.flatnonzero(moves > WITHDRAWAL.moves * std):
            reasons[k] = f"it depends on an effect larger than usual: {describe_group(group)}"
    return reasons


def find_large_groups(correction: Correction) -> list[Group]:
    """Return the groups whose amounts refute their priors."""
    step = correction.step
    sizes = np.abs(step.amounts) * step.columns.scale
    large = [g for g, one in zip(step.columns.groups, sizes, strict=True) if one > WITHDRAWAL.sizes]
    return [one for one in dict.fromkeys(large) if one.effect not in EXEMPT]
