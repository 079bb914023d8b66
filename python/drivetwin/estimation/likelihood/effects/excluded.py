# SPDX-License-Identifier: MIT
"""Effects that the card excludes although the log shows them."""

from __future__ import annotations

from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.effects.expansion import expand_effects
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.result.cause import WRONG_ENTRY
from drivetwin.findings import Code, Finding, report
from drivetwin.vehicle.effects import EffectId


def admit_excluded(
    fit: LikelihoodFit, priors: EffectPriors
) -> tuple[EffectPriors, tuple[Finding, ...]]:
    """Admit effects that the card excludes and the log shows, as any entry that is wrong.

    Parameters
    ----------
    fit
        Fit of the dual clutch.
    priors
        Statements of the card on effects and sensors.

    Returns
    -------
    EffectPriors
        Statements without the exclusions that the log contradicts: with its default prior the
        effect has more log evidence than all others by `WRONG_ENTRY`.
    tuple of Finding
        A warning for each of these effects.
    """
    if not priors.excluded:
        return priors, ()
    found = expand_effects(fit, priors.drop_statements(priors.excluded))
    if found is None:
        return priors, ()
    best: dict[EffectId, float] = {}
    for group, one in found.evidence.items():
        if group.effect is not None:
            best[group.effect] = max(best.get(group.effect, 0.0), one.nats)
    allowed = max((best[name] for name in best if name not in priors.excluded), default=0.0)
    lead = {name: best[name] - allowed for name in best if name in priors.excluded}
    shown = [name for name in lead if lead[name] > WRONG_ENTRY]
    warnings = tuple(
        report(Code.EFFECT_EXCLUDED, effect=EFFECTS[one].meaning, key=one.value, evidence=lead[one])
        for one in shown
    )
    return priors.drop_statements(shown), warnings
