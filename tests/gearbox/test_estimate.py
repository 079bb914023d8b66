# SPDX-License-Identifier: MIT
"""The error of leaving M12 out: estimated before, against the simulated peak."""

from __future__ import annotations

from dataclasses import asdict, replace
from itertools import pairwise

import pytest

from drivetwin.gearbox import Gearbox, compare, estimate, load_gearbox, reduce

WITHIN = 0.20
"""The estimate is for a decision, not for correction; its bound in every signal."""
QUIET = {"input": 2.0, "main": 0.06, "output": 0.9}


def check(box: Gearbox, old: str, new: str) -> None:
    shift = reduce(box, old, new)
    before, seen = asdict(estimate(shift)), asdict(compare(shift).error)
    assert before == pytest.approx(seen, rel=WITHIN)


@pytest.mark.parametrize("drum", [0.05, 0.1, 0.2])
@pytest.mark.parametrize("member", ["R1", "R2-C1"])
@pytest.mark.parametrize("family", ["three-set-3000", "three-set-4000cr", "three-set-4500wr"])
def test_brake_drums(family: str, member: str, drum: float) -> None:
    check(replace(load_gearbox(family), inertias=QUIET | {member: drum}), "2", "3")


@pytest.mark.parametrize("inertia", [0.2, 0.5, 2.0])
def test_a_heavy_member_that_is_no_drum(inertia: float) -> None:
    check(replace(load_gearbox("three-set-3000"), inertias=QUIET | {"R3-C2": inertia}), "2", "3")


@pytest.mark.parametrize("name", ["three-set-1000", "three-set-3000", "ravigneaux-4", "simpson-3"])
def test_neighbouring_gears_up_and_down(name: str) -> None:
    box = load_gearbox(name)
    forward = [gear.name for gear in box.gears if gear.published > 0.0]
    for low, high in pairwise(forward):
        check(box, low, high)
        check(box, high, low)


@pytest.mark.parametrize("name", ["zf-8hp70", "gm-8l90"])
def test_power_upshifts_of_eight_speeds(name: str) -> None:
    box = load_gearbox(name)
    for low, high in pairwise([gear.name for gear in box.gears if gear.published > 0.0]):
        check(box, low, high)


def test_no_coupling_no_error() -> None:
    error = estimate(reduce(replace(load_gearbox("three-set-3000"), inertias=QUIET), "2", "3"))
    assert asdict(error) == pytest.approx(
        {"shaft_torque": 0.0, "input_speed": 0.0, "output_speed": 0.0}, abs=1e-9
    )
