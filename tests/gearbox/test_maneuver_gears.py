# SPDX-License-Identifier: MIT
"""Ratios of every gear of every built-in card against the published ones; power flow."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.errors import InputError
from drivetwin.gearbox import (
    Gearbox,
    describe_ratio_differences,
    list_builtin_gearboxes,
    load_gearbox,
    solve_gear,
)

ALL_GEARS = [
    (name, gear.name) for name in list_builtin_gearboxes() for gear in load_gearbox(name).gears
]


@pytest.mark.parametrize(("name", "gear"), ALL_GEARS)
def test_the_ratio_is_the_published_one(name: str, gear: str) -> None:
    box = load_gearbox(name)
    entry = box.get_gear(gear)
    assert solve_gear(box, gear).ratio == pytest.approx(entry.published, abs=entry.tolerance)


@pytest.mark.parametrize(("name", "gear"), ALL_GEARS)
def test_powers_and_torques_balance(name: str, gear: str) -> None:
    box = load_gearbox(name)
    solved = solve_gear(box, gear)
    assert solved.power_error < 1e-12
    assert solved.torque_error < 1e-12
    # What leaves at the output is the input power, and no element between them stores any.
    into_output = sum(f.torque for f in solved.flanges if f.member == box.output)
    assert into_output * (solved.speeds[box.output] or 0.0) == pytest.approx(1.0, abs=1e-12)
    assert into_output == pytest.approx(solved.ratio, rel=1e-12)


@pytest.mark.parametrize("name", ["three-set-3000", "zf-8hp70", "zf-8hp75", "ravigneaux-4"])
def test_a_planetary_set_shares_torque_as_its_teeth_do(name: str) -> None:
    box = load_gearbox(name)
    for gear in box.gears:
        solved = solve_gear(box, gear.name)
        for each in box.sets:
            sun = solved.get_torque(each.name, each.sun)
            assert solved.get_torque(each.name, each.ring) == pytest.approx(each.z * sun, abs=1e-12)
            carrier = solved.get_torque(each.name, each.carrier)
            assert carrier == pytest.approx(-(1.0 + each.z) * sun, abs=1e-12)


def test_a_ratio_that_is_not_the_published_one_is_told() -> None:
    box = load_gearbox("zf-8hp70")
    assert not describe_ratio_differences(box, {each.name: each.published for each in box.gears})
    (remark,) = describe_ratio_differences(box, {"6": 1.0, "R": -box.get_gear("R").published})
    assert remark.startswith("gear R: the computed ratio 3.2968 is not the published -3.2968 ")


def test_an_idle_shaft_has_no_speed() -> None:
    solved = solve_gear(load_gearbox("dual-clutch-7"), "1")
    assert solved.speeds["even shaft"] is None
    assert solved.speeds["odd shaft"] == pytest.approx(1.0)


def three_set(i1: float, i2: float, i3: float) -> tuple[float, float, float]:
    """z of the three-set layout from its first three ratios, by the Willis equations."""
    z3 = i1 - 1.0
    z2 = i2 * z3 / (i1 - i2) - 1.0
    z1 = z2 / ((i1 / i3 - 1.0) * (1.0 + z2) / z3 - 1.0) - 1.0
    return z1, z2, z3


@pytest.mark.parametrize(
    ("name", "first_three", "predicted", "bound"),
    [
        ("three-set-1000", (3.102, 1.81, 1.406), {"5": 0.71, "6": 0.61, "R": -4.49}, 0.01),
        ("three-set-3000", (3.49, 1.86, 1.41), {"5": 0.75, "6": 0.65, "R": -5.03}, 0.02),
        ("three-set-4000cr", (3.51, 1.91, 1.43), {"5": 0.74, "6": 0.64, "R": -4.80}, 0.01),
        ("three-set-4500wr", (4.70, 2.21, 1.53), {"5": 0.76, "6": 0.67, "R": -5.55}, 0.01),
    ],
)
def test_three_published_ratios_predict_the_other_gears(
    name: str, first_three: tuple[float, float, float], predicted: dict[str, float], bound: float
) -> None:
    box = load_gearbox(name)
    z = three_set(*first_three)
    sets = tuple(replace(each, z=value) for each, value in zip(box.sets, z, strict=True))
    family: Gearbox = replace(box, sets=sets)
    for gear, ratio in zip(("1", "2", "3"), first_three, strict=True):
        assert solve_gear(family, gear).ratio == pytest.approx(ratio, rel=1e-12)
    for gear, ratio in predicted.items():
        assert solve_gear(family, gear).ratio == pytest.approx(ratio, rel=bound)


def test_elements_that_make_no_gear_are_refused_with_the_reason() -> None:
    box = load_gearbox("three-set-3000")
    gears = tuple(replace(gear, elements=gear.elements[:1]) for gear in box.gears)
    with pytest.raises(InputError, match="2 free speeds remain where 1 must"):
        solve_gear(replace(box, gears=gears), "1")
