# SPDX-License-Identifier: MIT
"""The likelihood method beside the linear one: where their difference is worth a warning."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.data.shift_data import DesignData
from drivetwin.estimation.likelihood.pipeline import LINEAR_START, estimate_likelihood
from drivetwin.estimation.linear.estimates import assess_shifts
from drivetwin.estimation.linear.pipeline import identify_shift
from drivetwin.findings import Code
from drivetwin.simulation.dual_clutch import RoadLoad
from tests.support.bench import Knowledge, record_bench

DESIGN = DesignData("paper", 5.0, (3.0, 9.0), (1000.0, 9000.0))
GROWTH = 40.0
"""Enough, N·m·s²/rad², for the linear method to err beyond its noise."""


def test_a_growing_load_is_told_and_not_that_the_linear_method_knows_none() -> None:
    base = load_scenario("throttle_steps")
    load = RoadLoad(base.model.load.constant, aero=GROWTH)
    made = record_bench(replace(base, model=replace(base.model, load=load)), 0, Knowledge())
    signals, drivelines = [made.signals], [made.driveline]
    shifts = [identify_shift(made.signals, made.driveline, 5.0)]
    linear = assess_shifts(shifts, signals, drivelines, {})
    told, _ = estimate_likelihood(signals, drivelines, (linear, shifts), DESIGN)
    assert told.load is not None
    assert [one.code for one in told.findings].count(Code.LOAD_GROWS) == 1
    linear_J, J = linear.estimates["J_vehicle"], told.estimates["J_vehicle"]
    assert linear_J.value is not None
    assert linear_J.std_noise is not None
    assert J.value is not None
    assert abs(linear_J.value - J.value) > LINEAR_START.disagreement * linear_J.std_noise
    assert Code.METHODS_DIFFER not in [one.code for one in told.findings]
