# SPDX-License-Identifier: MIT
"""Verdicts by interval width, propagation of covariance, sensor tolerances."""

from __future__ import annotations

import re

import numpy as np
import pytest

from drivetwin.estimation.result.estimate import Verdict
from drivetwin.estimation.result.verdict import (
    assess,
    assess_with_prior,
    compute_correlation,
    get_advice,
    refuse_parameter,
)
from drivetwin.parameters import SPECS
from drivetwin.vehicle.spec import PriorValue


@pytest.mark.parametrize(
    ("std", "verdict"),
    [
        (0.1, Verdict.IDENTIFIED),
        (4.0, Verdict.WEAK),
        (20.0, Verdict.NOT_IDENTIFIABLE),
    ],
)
def test_verdict_follows_the_width(std: float, verdict: Verdict) -> None:
    estimate = assess("J_prime_2", 17.5, std, "likelihood")
    assert estimate.verdict is verdict
    assert (estimate.value is None) == (verdict is Verdict.NOT_IDENTIFIABLE)
    assert (estimate.reason == "") == (verdict is Verdict.IDENTIFIED)


def test_systematic_part_counts_in_the_verdict() -> None:
    assert assess("eta", 0.85, 0.001, "likelihood", 0.3).verdict is Verdict.WEAK


@pytest.mark.parametrize(
    ("noise", "systematic", "sensors"), [(0.05, 0.3, True), (0.3, 0.05, False), (0.3, None, False)]
)
def test_no_experiment_is_advised_where_the_sensors_decide(
    noise: float, systematic: float | None, sensors: bool
) -> None:
    reason = assess("eta", 0.85, noise, "likelihood", systematic).reason
    assert ("Step the pedal" not in reason) == sensors
    assert ("Calibrate" in reason) == sensors


def test_a_delay_of_zero_is_sound() -> None:
    assert assess("te_delay", 0.0, 0.0005, "likelihood").verdict is Verdict.IDENTIFIED
    assert assess("te_delay", 0.0, 0.05, "likelihood").verdict is Verdict.NOT_IDENTIFIABLE


def test_a_value_outside_its_bounds_is_never_given() -> None:
    assert assess("J_vehicle", -400.0, 1.0, "likelihood").value is None


def test_refusal_names_the_experiment() -> None:
    assert "pedal" in refuse_parameter("te_delay", "likelihood", "no motion").reason


DRUM = PriorValue(0.05, 0.03)


@pytest.mark.parametrize(
    ("value", "std", "verdict"),
    [
        (0.05, 0.029, Verdict.DESIGN),
        (0.0067, 0.022, Verdict.WEAK),
        (0.05, 0.012, Verdict.WEAK),
        (0.05, 0.002, Verdict.IDENTIFIED),
    ],
)
def test_what_the_card_states_keeps_a_number_the_better_known_the_more_its_own(
    value: float, std: float, verdict: Verdict
) -> None:
    one = assess_with_prior(("drum.B3", value, std), DRUM, "likelihood with design prior")
    assert (one.value, one.std_noise, one.verdict) == (value, std, verdict)
    assert bool(one.reason) == (verdict is not Verdict.IDENTIFIED)


def test_what_is_impossible_is_withheld_although_the_card_states_it() -> None:
    one = assess_with_prior(("drum.B3", -0.2, 0.002), DRUM, "likelihood with design prior")
    assert one.verdict is Verdict.NOT_IDENTIFIABLE


def test_correlation_of_a_known_parameter_is_zero() -> None:
    matrix = compute_correlation(np.array([[4.0, 0.0], [0.0, 0.0]]))
    assert matrix.tolist() == [[1.0, 0.0], [0.0, 1.0]]


@pytest.mark.parametrize("share", [0.3, 0.99])
@pytest.mark.parametrize("stem", SPECS)
def test_advice_asks_for_no_entry_that_the_card_states(stem: str, share: float) -> None:
    """Advice on a value that its own design value, its noise or its sensors limit."""
    ending = {"gear": "_2", "element": ".B2", "channel": ".x"}.get(SPECS[stem].suffix, "")
    noise = float(np.sqrt(1.0 - share**2))
    advice = get_advice(f"{stem}{ending}", noise, share)
    assert not re.search(r"\b[Ee]nter\b|\b[Ss]tate\b|\bsmaller\b|\bcard\b", advice)


def test_a_held_value_keeps_the_declaration_of_its_quantity() -> None:
    declared = SPECS["eta"]
    one = assess_with_prior(("K2.onset", 0.4, 0.0), PriorValue(0.4, 0.0), "log", declared=declared)
    assert (one.verdict, one.unit) == (Verdict.DESIGN, declared.unit)
