# SPDX-License-Identifier: MIT
"""Identifications of short synthetic logs, for tests of what is asked about them."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.signal import lfilter

import drivetwin
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.analysis.profile_likelihood import get_likelihood_fit
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.fit import compute_covariance
from drivetwin.estimation.result.method import Method
from drivetwin.pipeline import identify
from drivetwin.vehicle.effects import EffectId, EffectPrior
from drivetwin.vehicle.vehicle_card import VehicleCard
from tests.support.shared_results import shared

DURATION = 3.3
RATE = 400.0
"""Hz of the logger: less than usual, so that the many fits of a test take less time."""


def record_log(scenario: str, P0_std: float = 0.0) -> tuple[ShiftLog, VehicleCard]:
    """Record a scenario and read its log.

    The card leaves P0 a spread of `P0_std` [Pa] and states that the model leaves no effect out, as
    is true of the dynamometer: intervals are those of noise.
    """
    base = load_scenario(scenario)
    sensors = tuple(replace(s, rate=min(s.rate, RATE)) for s in base.sensors)
    made = run(replace(base, duration=DURATION, sensors=sensors), seed=3)
    with tempfile.TemporaryDirectory() as folder:
        log_file, card_file, _ = write_run(Path(folder) / "log.csv", made)
        card = drivetwin.load_card(card_file)
        elements = {
            name: replace(one, P0=replace(one.P0, std=P0_std))
            for name, one in card.elements.items()
        }
        none = {effect: EffectPrior(0.0) for effect in EffectId}
        card = replace(card, elements=elements, effects=none)
        mapping = Path(folder) / "rows.toml"
        mapping.write_text("[time]\nsimultaneous = true\n", encoding="utf-8")
        return drivetwin.read_log(log_file, card, mapping), card


def _identified(scenario: str, method: Method, P0_std: float = 0.0) -> Identification:
    log, card = record_log(scenario, P0_std)
    return identify(log, card, drivetwin.detect_shifts(log, card), method)


@shared
def still() -> Identification:
    """A log at constant engine torque: it cannot tell the torque's age."""
    return _identified("paper", Method.LIKELIHOOD)


@shared
def stepped() -> Identification:
    """The same driveline with throttle steps before the shift."""
    return _identified("paper_steps", Method.LIKELIHOOD)


@shared
def uncertain_fills() -> Identification:
    """The log at constant engine torque, by a card that leaves P0 a tenth of a bar of spread."""
    return _identified("paper", Method.LIKELIHOOD, P0_std=1e4)


@shared
def by_the_paper() -> Identification:
    """The same by a method without a likelihood."""
    return _identified("paper", Method.PAPER)


def slowed(found: Identification) -> Identification:
    """The same, if its residuals were those of sensors behind a filter of some 20 ms."""
    fit, _ = get_likelihood_fit(found)
    rng = np.random.default_rng(2)
    residuals = tuple(
        term.record.sigma * lfilter([np.sqrt(0.19)], [1.0, -0.9], rng.normal(size=term.record.size))
        for term in fit.problem.terms
    )
    normal = replace(fit.normal, residuals=residuals)
    wide = replace(fit, normal=normal, covariance=compute_covariance(fit.problem, normal, fit.chi2))
    return replace(found, evidence=replace(found.evidence, likelihood=wide))
