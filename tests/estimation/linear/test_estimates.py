# SPDX-License-Identifier: MIT
"""What a still engine torque in the lower gear costs, and values that physics excludes."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.estimation.analysis.profile_likelihood import get_likelihood_fit
from drivetwin.estimation.linear.estimates import INTEGRAL_VERDICT, assess_shifts
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.estimation.result.estimate_set import (
    EstimateSet,
    check_excitation,
)
from drivetwin.findings import render
from drivetwin.vehicle.spec import PriorValue
from tests.estimation.asked import stepped, still


def test_a_gear_with_still_torque_is_named() -> None:
    notes = check_excitation(still().evidence.signals)
    assert set(notes) == {"eta", "J_prime_2", "J_prime_3"}
    assert notes["eta"].names["gear"] == "2"


def _with_J_out(value: float, known: PriorValue | None, sensors: float = 0.0) -> EstimateSet:
    """The conclusions of the linear fit of a log as if it had found Jo′ to be `value`."""
    found = stepped()
    (shift,), signals = found.evidence.integral, found.evidence.signals
    values = shift.values.copy()
    values[shift.ids.index("J_out")] = value
    driveline = get_likelihood_fit(found)[0].problem.terms[0].structure.driveline
    driveline = replace(driveline, J_out=known)
    return assess_shifts([replace(shift, values=values)], signals, [driveline], {"J_out": sensors})


def test_where_the_linear_fit_gives_the_impossible_the_card_stands() -> None:
    told = _with_J_out(-0.2, PriorValue(0.9, 0.09)).estimates["J_out"]
    assert (told.value, told.std_noise, told.verdict) == (0.9, 0.09, Verdict.DESIGN)
    assert "−0.200 kg·m², which is physically impossible" in told.reason


def test_a_value_far_off_the_cards_is_no_design_value_however_wide() -> None:
    told = _with_J_out(29.9, PriorValue(1.35, 0.01))
    assert told.estimates["J_out"].verdict is Verdict.WEAK
    assert "contradicts" in told.estimates["J_out"].reason
    assert any(
        text.startswith("J_out: the vehicle card has 1.35") for text in render(told.findings)
    )


def test_sensors_that_tell_less_than_the_card_leave_its_value_alone() -> None:
    card = PriorValue(1.35, 0.1)
    told = _with_J_out(1.4, card, sensors=0.3).estimates["J_out"]
    assert (told.value, told.std_total, told.verdict) == (1.35, 0.1, Verdict.DESIGN)
    assert "sensor tolerances" in told.reason
    assert _with_J_out(1.4, card, sensors=0.05).estimates["J_out"].value == 1.4


@pytest.mark.parametrize(
    ("stage", "touched", "spared"),
    [("momentum", "J_prime_2", "Tv_over_if"), ("load", "J_vehicle", "eta")],
)
def test_where_a_regression_leaves_far_more_than_noise_nothing_of_it_is_identified(
    stage: str, touched: str, spared: str
) -> None:
    found = stepped()
    (shift,), signals = found.evidence.integral, found.evidence.signals
    driveline = get_likelihood_fit(found)[0].problem.terms[0].structure.driveline
    before = getattr(shift, stage)
    for chi2, verdict in (
        (0.9 * INTEGRAL_VERDICT.misfit_power, Verdict.IDENTIFIED),
        (1.1 * INTEGRAL_VERDICT.misfit_power, Verdict.WEAK),
    ):
        after = replace(before, fit=replace(before.fit, chi2=chi2))
        told = assess_shifts([replace(shift, **{stage: after})], signals, [driveline], {}).estimates
        assert told[touched].verdict is verdict
        assert told[spared].verdict is Verdict.IDENTIFIED
    assert "11 times the noise power" in told[touched].reason


def test_shifts_that_add_nothing_to_the_fill_pressure_leave_it_the_cards() -> None:
    found = stepped()
    (shift,), signals = found.evidence.integral, found.evidence.signals
    driveline = get_likelihood_fit(found)[0].problem.terms[0].structure.driveline
    name, design = f"P0.{driveline.oncoming.name}", PriorValue(8e4, 5e3)
    coupling = replace(driveline.oncoming, P0=design)
    couplings = {**driveline.couplings, coupling.name: coupling}
    driveline = replace(driveline, oncoming=coupling, couplings=couplings)
    covariance = shift.covariance.copy()
    place = shift.ids.index(name)
    covariance[place, place] = design.std**2
    silent = replace(shift, covariance=covariance, priors={**shift.priors, name: design})
    told = assess_shifts([silent] * 3, [*signals] * 3, [driveline] * 3, {}).estimates
    assert told[name].verdict is Verdict.DESIGN
    assert told[name].std_noise == pytest.approx(design.std)
    assert "te_rounding" not in told


def test_what_is_impossible_and_not_on_the_card_is_refused() -> None:
    told = _with_J_out(-0.2, None).estimates["J_out"]
    assert told.value is None
    assert "impossible" in told.reason
