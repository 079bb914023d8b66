# SPDX-License-Identifier: MIT
"""Short synthetic logs of one vehicle, at two torque levels and loads, and what they tell."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import drivetwin
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.simulation.dual_clutch import RoadLoad
from drivetwin.validation.validated_model import JointIdentification, Source, identify_together
from drivetwin.vehicle.card import VehicleCard
from tests.estimation.asked import DURATION
from tests.support.bench import read_run
from tests.support.shared_results import shared

LEVEL = 0.85
"""Engine torque of the second log over that of the first."""
LOADS = (2300.0, 2000.0)
"""T_v/i_f [N m] of both."""


def scenario(level: float = 1.0, load: float = LOADS[0], payload: float = 1.0) -> Any:
    """The paper's vehicle with throttle steps; `payload` multiplies the vehicle's inertia."""
    base = load_scenario("paper_steps")
    knots = tuple((time, level * value) for time, value in base.engine_torque.knots)
    torque = replace(base.engine_torque, knots=knots)
    model = replace(
        base.model, load=RoadLoad(constant=load * base.model.i_f), J_v=payload * base.model.J_v
    )
    return replace(base, model=model, engine_torque=torque, duration=DURATION)


def source(made: Any, seed: int, held: frozenset[int] = frozenset()) -> Source:
    """A log of the scenario with its shifts; named after the seed."""
    log, _ = read_run(run(made, seed=seed), name=f"log{seed}")
    return Source(log, drivetwin.detect_shifts(log, card()), held)


@cache
def card() -> VehicleCard:
    """The card of all of them."""
    return read_run(run(scenario(), seed=0), name="any")[1]


@shared
def pair() -> tuple[Source, Source]:
    """Two logs at two torque levels and loads."""
    return source(scenario(), 21), source(scenario(LEVEL, LOADS[1]), 22)


@shared
def together() -> JointIdentification:
    """Both fitted as one, and a third one predicted."""
    third = source(scenario(), 23, frozenset({1}))
    return identify_together([*pair(), third], card())


@shared
def loaded() -> JointIdentification:
    """Two logs of which the second has a payload that the first has not."""
    return identify_together([pair()[0], source(scenario(payload=1.03), 24)], card())
