# SPDX-License-Identifier: MIT
"""Guesses of a start: what the channels show replaces what the model states."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from drivetwin.fit.recording import Measured, Recording, build_network_record
from drivetwin.fit.starts import StartGuess, complete_start, guess_start
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import Element, Output, Start, build_element
from drivetwin.vehicle.spec import PriorValue

TIME = np.linspace(0.0, 2.0, 401)
ELEMENTS: list[Element] = [
    build_element("torque", "source", node="a", input="T"),
    build_element("inertia", "motor", node="a", inertia=0.1),
    build_element("spring_damper", "shaft", a="a", b="b", stiffness=500.0, damping=1.0),
    build_element("inertia", "wheel", node="b", inertia=2.0),
]
STATED = Start({"a": 50.0, "b": 50.0})
OUTPUTS: Mapping[str, Output] = {"speed": ("speed", "a"), "torque": ("shaft_torque", "shaft")}


def guess(known: Mapping[str, float]) -> StartGuess:
    rng = np.random.default_rng(0)
    outputs = {
        "speed": Measured(TIME, 80.0 + 3.0 * TIME + 0.01 * rng.standard_normal(TIME.size)),
        "torque": Measured(TIME, 25.0 - TIME + 0.05 * rng.standard_normal(TIME.size)),
    }
    recording = Recording({"T": Signal(TIME, np.full(TIME.size, 40.0))}, outputs)
    record = build_network_record(recording, list(OUTPUTS), {})
    priors = {name: PriorValue(value) for name, value in known.items()}
    return guess_start(STATED, priors, ELEMENTS, OUTPUTS, record)


def test_measured_speeds_and_torques_give_speeds_and_twists() -> None:
    found = guess({})
    assert found.start.speeds["a"] == pytest.approx(80.0, abs=0.02)
    assert found.start.speeds["b"] == 50.0
    assert found.start.twists["shaft"] == pytest.approx(25.0 / 500.0, rel=0.01)
    assert set(found.priors) == {"a", "b", "shaft"}


def test_the_priors_are_wider_than_what_a_start_can_miss() -> None:
    found = guess({})
    for name in ("a", "b"):
        assert found.priors[name].std > 20.0
    assert found.priors["shaft"].std >= 3.0 * 40.0 / 500.0


def test_what_is_known_is_taken_and_has_no_prior() -> None:
    found = guess({"a": 79.0, "shaft": 0.04})
    assert found.start.speeds == {"a": 79.0, "b": 50.0}
    assert found.start.twists == {"shaft": 0.04}
    assert set(found.priors) == {"b"}


def test_starts_are_stated_nodes_and_all_shafts() -> None:
    found = complete_start(STATED, ELEMENTS)
    assert [*found.speeds, *found.twists] == ["a", "b", "shaft"]
