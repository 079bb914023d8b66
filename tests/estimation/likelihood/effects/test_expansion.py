# SPDX-License-Identifier: MIT
"""An effect that the card excludes acts only where the log contradicts the exclusion."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.estimation.mismatch_log import Rates, make_mismatch_log
from drivetwin.estimation.likelihood.effects import expansion
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.effects.expansion import (
    EffectExpansion,
    admit_excluded,
    expand_effects,
)
from drivetwin.estimation.likelihood.effects.joint_step import GroupEvidence
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.result.cause import Group
from drivetwin.findings import Code
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.effects import EffectId, EffectPrior
from tests.estimation.likelihood.fixtures import fitted

NONE = EffectPrior(0.0)
PRIORS = EffectPriors({EffectId.TYRE_SLIP: NONE, EffectId.BACKLASH: NONE})


@pytest.mark.parametrize(
    ("excluded_nats", "allowed_nats", "admitted"),
    [(30.0, 5.0, True), (30.0, 25.0, False), (9.0, 0.0, False)],
)
def test_an_exclusion_falls_by_the_lead_of_its_evidence(
    monkeypatch: pytest.MonkeyPatch, excluded_nats: float, allowed_nats: float, admitted: bool
) -> None:
    nats = {EffectId.TYRE_SLIP: excluded_nats, EffectId.SLOW_LOAD: allowed_nats}

    def expand(fit: LikelihoodFit, priors: EffectPriors) -> EffectExpansion | None:
        assert not priors.excluded
        found = expand_effects(fit, priors)
        assert found is not None
        none = np.zeros(1)
        evidence = {
            Group(name): GroupEvidence(one, none, none, (0,), none, none)
            for name, one in nats.items()
        }
        return replace(found, evidence=evidence)

    monkeypatch.setattr(expansion, "expand_effects", expand)
    priors, findings = admit_excluded(fitted(), PRIORS)
    assert (EffectId.TYRE_SLIP not in priors.effects) is admitted
    assert EffectId.BACKLASH in priors.effects
    assert [one.code for one in findings] == [Code.EFFECT_EXCLUDED] * admitted


def test_exclusions_of_a_log_that_obeys_the_model_stand() -> None:
    priors = EffectPriors(dict.fromkeys(EffectId, NONE))
    for one in (priors, EffectPriors()):
        kept, findings = admit_excluded(fitted(), one)
        assert kept.effects == one.effects
        assert findings == ()


def test_a_delay_of_the_output_torque_that_the_card_excludes_is_found() -> None:
    """Without it the model was not valid, and every value was withdrawn."""
    made = make_mismatch_log(63, EffectId.OUTPUT_TORQUE_DELAY, 0.002, Rates.LOGGER)
    card = replace(made.card, effects={EffectId.OUTPUT_TORQUE_DELAY: NONE})
    found = identify(made.log, card, detect_shifts(made.log, card))
    (warning,) = [one for one in found.findings if one.code is Code.EFFECT_EXCLUDED]
    assert "output_torque_delay" in warning.remedy
    cause = found.evidence.cause
    assert cause is not None
    assert cause.group.effect is EffectId.OUTPUT_TORQUE_DELAY
    truth = made.recorded.truth.parameters
    inside = [
        abs(one.value - truth[one.id]) < 3.0 * one.std_total
        for one in found.estimates.values()
        if one.id in truth and one.value is not None and one.std_total
    ]
    assert len(inside) > 8
    assert all(inside)
