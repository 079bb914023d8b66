# SPDX-License-Identifier: MIT
"""Identifications of short synthetic logs, for tests of what is asked about them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.signal import lfilter

import drivetwin
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.method import Method
from drivetwin.likelihood.covariance import compute_covariance
from drivetwin.pipeline import identify
from drivetwin.vehicle.card import VehicleCard
from tests.support.bench import NO_EFFECT, read_run
from tests.support.shared_results import shared

DURATION = 3.3
RATE = 400.0
"""Hz of the logger: less than usual, so that the many fits of a test take less time."""


def record_log(scenario: str, P0_std: float = 0.0) -> tuple[ShiftLog, VehicleCard]:
    """Record a scenario and read its log, by a card that states no effect: intervals are those of
    noise. P0 has a spread of `P0_std` [Pa]."""
    base = load_scenario(scenario)
    sensors = tuple(replace(s, rate=min(s.rate, RATE)) for s in base.sensors)
    made = run(replace(base, duration=DURATION, sensors=sensors), seed=3)
    return read_run(made, "[time]\nsimultaneous = true\n", P0_std, effects=NO_EFFECT)


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
    fit = found.evidence.likelihood
    assert fit is not None
    rng = np.random.default_rng(2)
    residuals = tuple(
        term.record.sigma * lfilter([np.sqrt(0.19)], [1.0, -0.9], rng.normal(size=term.record.size))
        for term in fit.problem.terms
    )
    normal = replace(fit.normal, residuals=residuals)
    wide = replace(fit, normal=normal, covariance=compute_covariance(fit.problem, normal, fit.chi2))
    return replace(found, evidence=replace(found.evidence, likelihood=wide))
