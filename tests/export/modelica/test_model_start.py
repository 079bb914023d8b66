# SPDX-License-Identifier: MIT
"""Initial equations: just as many as there are independent speeds and angles."""

from __future__ import annotations

from drivetwin.export.modelica.model import build_initial_equations
from drivetwin.simulation.network import Element, Start

ELEMENTS: list[Element] = [
    {"type": "gear", "name": "g", "a": "in", "b": "mid", "ratio": 2.0},
    {"type": "clutch", "name": "C", "a": "mid", "b": "out"},
    {"type": "clutch", "name": "D", "a": "in", "b": "out"},
    {"type": "spring_damper", "name": "s", "a": "out", "b": "ground"},
]
ANGLES = {"in": "a", "mid": "b", "out": "c"}
RESTS = {"C": "C.w_rel", "D": "D.w_rel"}
TWISTS = {"s": "s.phi_rel"}


def _equations(start: Start) -> list[str]:
    return build_initial_equations(ELEMENTS, start, ANGLES, RESTS, TWISTS)


def test_speeds_that_follow_from_others_are_not_stated_again() -> None:
    found = _equations(Start({"in": 8.0, "mid": 4.0, "out": 1.0}, {"s": 0.25}))
    assert found == ["der(a) = 8.0;", "der(c) = 1.0;", "s.phi_rel = -0.25;", "a = 0;"]


def test_a_locked_element_goes_before_a_stated_speed() -> None:
    found = _equations(Start({"in": 8.0, "out": 1.0}, locked=("C",)))
    assert found[:2] == ["C.w_rel = 0;", "der(a) = 8.0;"]
    assert "der(c) = 1.0;" not in found


def test_redundant_locks_are_stated_once() -> None:
    found = _equations(Start({"in": 8.0}, locked=("C", "D", "C")))
    assert found[:2] == ["C.w_rel = 0;", "D.w_rel = 0;"]
    assert "der(a) = 8.0;" not in found
