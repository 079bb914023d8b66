# SPDX-License-Identifier: MIT
"""Withdrawal of the verdict `identified` where the correction for effects is unreliable."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.effects.correction import Correction
from drivetwin.estimation.likelihood.effects.table import describe_group
from drivetwin.estimation.result.cause import Group
from drivetwin.estimation.result.spread import EXPLAINED
from drivetwin.findings import Code, Finding, report
from drivetwin.vehicle.effects import EffectId


@dataclass(frozen=True)
class WithdrawalSettings:
    """Limits beyond which a corrected value does not count as identified."""

    sizes: float = 3.0
    """Amount of an effect in stated prior standard deviations beyond which the prior is refuted,
    so that the interval of what the effect moves is too."""
    moves: float = 1.0
    """Move of a value by such an effect, in its standard deviations, that makes it unreliable."""
    last_step: float = 1.5
    """Move of a value by the last step, in its standard deviations, from which the effects are
    not linear: one more step would move it again."""
    chi2: float = EXPLAINED
    """Residual power per sample after the correction above which something is missing from the
    model that no effect describes."""


WITHDRAWAL = WithdrawalSettings()
EXEMPT = (EffectId.FRICTION_SHAPE, None)
"""Effects whose amounts may be large: shapes have no usual size, tolerances are the card's."""


def find_unreliable(
    correction: Correction, ids: Sequence[str], jacobian: FloatArray, std: FloatArray
) -> list[Finding]:
    """Find the values that the correction does not make reliable, each with the reason as an error.

    Parameters
    ----------
    ids : parameter ids (k,) of the values
    jacobian : derivatives (k, p) of the values by the unknowns of the fit
    std : total standard deviations (k,) of the values
    """
    chi2 = correction.step.chi2
    if chi2 > WITHDRAWAL.chi2:
        return [report(Code.RESIDUAL_UNEXPLAINED, chi2=chi2)]
    if not np.all(np.isfinite(correction.last)):
        return [report(Code.EFFECT_NOT_LINEAR, name) for name in ids]
    last = np.abs(jacobian @ correction.last)
    found = [
        report(Code.EFFECT_NOT_LINEAR, ids[int(k)])
        for k in np.flatnonzero(last > WITHDRAWAL.last_step * std)
    ]
    for group in find_large_groups(correction):
        moves = np.abs(jacobian @ correction.step.contributions[group])
        found += [
            report(Code.EFFECT_LARGE, ids[int(k)], effect=describe_group(group))
            for k in np.flatnonzero(moves > WITHDRAWAL.moves * std)
        ]
    return found


def compute_doubt(correction: Correction, jacobian: FloatArray) -> FloatArray:
    """Compute how far (k,) each value has been moved by what makes it unreliable.

    That is the last step, and the moves by groups beyond their priors. The interval of a value
    that is withdrawn reaches back over them.
    """
    moves = [np.nan_to_num(correction.last, posinf=0.0)]
    moves += [correction.step.contributions[one] for one in find_large_groups(correction)]
    return np.asarray(np.linalg.norm([jacobian @ one for one in moves], axis=0))


def find_large_groups(correction: Correction) -> list[Group]:
    """Return the groups whose amounts refute their priors."""
    step = correction.step
    sizes = np.abs(step.amounts) * step.columns.scale
    large = [g for g, one in zip(step.columns.groups, sizes, strict=True) if one > WITHDRAWAL.sizes]
    return [one for one in dict.fromkeys(large) if one.effect not in EXEMPT]
