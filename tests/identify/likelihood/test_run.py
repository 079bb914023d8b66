# SPDX-License-Identifier: MIT
"""The likelihood method beside the linear one: where their difference is worth a warning."""

from __future__ import annotations

from dataclasses import replace

from benchmarks.estimation.bench import Knowledge, realise
from drivetwin.driveline import RoadLoad
from drivetwin.dyno.scenarios import throttle_steps
from drivetwin.identify.conclude import conclude
from drivetwin.identify.integral import identify_shift
from drivetwin.identify.likelihood.run import DISAGREE, likelihood
from drivetwin.vehicle.spec import VehicleCard

GROWTH = 40.0
"""Enough, N·m·s²/rad², for the linear method to err beyond its noise."""


def test_a_growing_load_is_told_and_not_that_the_linear_method_knows_none() -> None:
    base = throttle_steps()
    load = RoadLoad(base.model.load.constant, aero=GROWTH)
    made = realise(replace(base, model=replace(base.model, load=load)), 0, Knowledge())
    card = VehicleCard("truck", "paper", 1.0, 5.0, (), {}, (3.0, 9.0), (1000.0, 9000.0))
    signals, drivelines = [made.signals], [made.driveline]
    shifts = [identify_shift(made.signals, made.driveline, 5.0)]
    linear = conclude(shifts, signals, drivelines, {})
    told, _ = likelihood(signals, drivelines, (linear, shifts), card)
    assert told.load is not None
    assert sum("grows with the square of the speed" in text for text in told.warnings) == 1
    linear_J, J = linear.estimates["J_vehicle"], told.estimates["J_vehicle"]
    assert linear_J.value is not None
    assert linear_J.std_noise is not None
    assert J.value is not None
    assert abs(linear_J.value - J.value) > DISAGREE * linear_J.std_noise
    assert not any("the linear method" in text for text in told.warnings)
