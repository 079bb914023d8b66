# SPDX-License-Identifier: MIT
"""Status of a model: trust in its values, and replay of the log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.estimation.identification import Identification, StageResults
from drivetwin.estimation.result.cause import PredictedSpread
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.findings import Code, report
from drivetwin.likelihood.output import SignalFit
from drivetwin.validation.gate import assess_model
from drivetwin.vehicle.spec import PriorValue
from tests.report.sample import TIME, identification, validation


def _simulated(percent: float, std: float | None) -> Identification:
    """Return the sample with a fit of the output torque [%], and a predicted spread [N m]."""
    found = identification()
    torque = {"output_torque": PredictedSpread(TIME, np.zeros(TIME.size), np.full(TIME.size, std))}
    evidence = StageResults(validation=(validation(),), spread=() if std is None else (torque,))
    estimates = {
        name: one for name, one in found.estimates.items() if one.verdict is Verdict.IDENTIFIED
    }
    fit = {"output_torque": {"all": SignalFit(100.0, percent)}}
    return replace(found, evidence=evidence, fit=fit, estimates=estimates)


def test_a_poor_fit_within_its_spread_is_a_remark() -> None:
    """The simulation of the sample misses the torque by 22 N·m."""
    found = assess_model(_simulated(30.0, 10.0))
    assert found.status is ModelStatus.LIMITED
    assert found.findings[0].code is Code.SIMULATION_NOISY
    assert found.estimates["eta"].verdict is Verdict.IDENTIFIED
    assert assess_model(_simulated(90.0, 10.0)).status is ModelStatus.VALID


@pytest.mark.parametrize(("percent", "std"), [(30.0, None), (90.0, 2.0), (30.0, 2.0)])
def test_a_fit_without_spread_and_a_phase_outside_it_are_failures(
    percent: float, std: float | None
) -> None:
    found = assess_model(_simulated(percent, std))
    assert found.status is ModelStatus.NOT_VALID
    assert found.estimates["eta"].verdict is Verdict.WEAK


def test_the_phases_outside_their_spread_are_one_finding() -> None:
    found = assess_model(_simulated(90.0, 2.0))
    (one,) = [each for each in found.findings if each.code is Code.SIMULATION_OUTSIDE_SPREAD]
    assert {row.names["phase"] for row in one.rows} == {"before", "torque", "inertia", "after"}
    assert one.numbers["ratio"].value == max(row.numbers["ratio"].value for row in one.rows)


def test_an_unexplained_residual_is_not_valid_whatever_is_missing() -> None:
    bare = replace(identification(), evidence=StageResults())
    assert assess_model(bare).status is ModelStatus.NOT_VALIDATED
    residual = report(Code.RESIDUAL_UNEXPLAINED, chi2=2.6)
    assert assess_model(replace(bare, findings=(residual,))).status is ModelStatus.NOT_VALID


def test_only_a_valid_model_is_confirmed() -> None:
    confirmed = {one for one in ModelStatus if one.is_confirmed}
    assert confirmed == {ModelStatus.VALID, ModelStatus.LIMITED}


ASSUMED = PriorValue(0.027, 0.005, assumed=True)


@pytest.mark.parametrize(
    ("factor", "gain", "status", "code"),
    [
        (1.0, PriorValue(0.027), ModelStatus.VALID, None),
        (1.4, PriorValue(0.027), ModelStatus.VALID, Code.GAIN_SUSPECT),
        (10.0, PriorValue(0.027), ModelStatus.NOT_VALID, Code.FRICTION_IMPOSSIBLE),
        (0.1, PriorValue(0.027), ModelStatus.NOT_VALID, Code.FRICTION_IMPOSSIBLE),
        (10.0, ASSUMED, ModelStatus.LIMITED, Code.FRICTION_IMPLAUSIBLE),
    ],
)
def test_a_card_with_an_impossible_gain_makes_no_valid_model(
    factor: float, gain: PriorValue, status: ModelStatus, code: Code | None
) -> None:
    """The log determines μ times gain, so that μ falls as the gain on the card rises."""
    found, stated = _simulated(90.0, 10.0), gain.scale(factor)
    (curve,) = found.friction.values()
    scaled = replace(
        curve, mu=curve.mu / factor, mu_lo=curve.mu_lo / factor, mu_hi=curve.mu_hi / factor
    ).add_gain_spread(stated)
    suspect = report(
        Code.GAIN_SUSPECT, element="B3", mu=0.1, gain=stated.value, low=0.02, high=0.03
    )
    before = report(
        Code.CARD_FRICTION_UNUSUAL, element="B3", found=1.0, unit="m³", mu=0.1, shift="2-3",
        low=0.02, high=0.03, product=1e-3,
    )  # fmt: skip
    suspects = () if factor == 1.0 else (suspect, before)
    judged = assess_model(replace(found, friction={"B3": scaled}, findings=suspects))
    assert judged.status is status
    named = {
        Code.GAIN_SUSPECT, Code.FRICTION_IMPOSSIBLE, Code.FRICTION_IMPLAUSIBLE,
        Code.CARD_FRICTION_UNUSUAL,
    }  # fmt: skip
    assert [one.code for one in judged.findings if one.code in named] == [code] * (code is not None)
    if code is Code.FRICTION_IMPOSSIBLE:
        numbers = next(one for one in judged.findings if one.code is code).numbers
        assert numbers["least"].value < 0.027 < numbers["most"].value
        assert judged.estimates["eta"].verdict is Verdict.WEAK


@pytest.mark.parametrize(("partner", "refuted"), [("B3", True), ("B2", False)])
def test_a_gain_that_card_and_log_contradict_makes_no_valid_model(
    partner: str, refuted: bool
) -> None:
    unequal = report(
        Code.CARD_GAINS_UNEQUAL, element="B3", found=0.27, unit="m³", factor=10.0, others="B2",
        low=0.01, high=0.1,
    )  # fmt: skip
    contradiction = report(Code.GAINS_CONTRADICT, element="B2", partner=partner, ratio=0.7)
    found = replace(_simulated(90.0, 10.0), findings=(unequal, contradiction))
    judged = assess_model(found)
    assert (judged.status is ModelStatus.NOT_VALID) is refuted
    codes = [one.code for one in judged.findings]
    assert (Code.GAIN_REFUTED in codes) is refuted
    assert (Code.CARD_GAINS_UNEQUAL in codes) is not refuted
