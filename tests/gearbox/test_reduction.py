# SPDX-License-Identifier: MIT
"""Shifts as a dual clutch: ratios, condition (1) in words, drums that carry M12, refusals."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from drivetwin.errors import ReductionError
from drivetwin.gearbox import Gearbox, load_gearbox, reduce, solve_gear

QUIET = {"input": 2.0, "main": 0.06, "output": 0.9}


def three_set(**inertias: float) -> Gearbox:
    named = {name.replace("_", "-"): value for name, value in inertias.items()}
    return replace(load_gearbox("three-set-3000"), inertias=QUIET | named)


def test_a_brake_has_the_ratios_of_its_gear() -> None:
    shift = reduce(load_gearbox("three-set-3000"), "2", "3")
    assert (shift.off_going.element, shift.on_coming.element) == ("C4", "C3")
    assert shift.common == ("C1",)
    assert shift.off_going.i_c == pytest.approx(0.86, abs=1e-3)
    assert shift.off_going.i_out == pytest.approx(1.86 / 0.86, rel=1e-3)
    assert shift.on_coming.i_c == pytest.approx(0.41, abs=1e-3)
    assert shift.off_going.sense == -1.0


@pytest.mark.parametrize(
    ("name", "old", "new"),
    [
        ("three-set-4000cr", "4", "5"),
        ("zf-8hp70", "2", "3"),
        ("zf-8hp75", "2", "3"),
        ("gm-8l90", "7", "8"),
        ("ravigneaux-4", "3", "4"),
        ("simpson-3", "2", "3"),
        ("dual-clutch-7", "2", "3"),
        ("manual-6", "3", "4"),
    ],
)
def test_the_ratios_multiply_to_those_of_both_gears(name: str, old: str, new: str) -> None:
    box = load_gearbox(name)
    shift = reduce(box, old, new)
    for ratios, gear in ((shift.off_going, old), (shift.on_coming, new)):
        assert ratios.ratio == pytest.approx(solve_gear(box, gear).ratio, rel=1e-12)
        assert ratios.i_c > 0.0


def test_condition_1_holds_without_members_on_both_shafts() -> None:
    shift = reduce(three_set(), "2", "3")
    assert shift.exact
    assert shift.coupling_ratio < 1e-12
    assert shift.violations == ()
    assert "holds" in shift.describe_condition()


def test_condition_1_names_the_members_that_violate_it() -> None:
    shift = reduce(three_set(R1=0.08, R3_C2=0.4), "2", "3")
    assert [each.member for each in shift.violations] == ["R1", "R3-C2"]
    assert pytest.approx(sum(each.coupling for each in shift.violations)) == shift.M12
    assert "violated" in shift.describe_condition()
    assert "R1" in shift.describe_condition()


def test_couplings_of_both_signs_can_cancel() -> None:
    box = replace(load_gearbox("zf-8hp70"), inertias={"input": 0.1, "output": 0.05, "S1-S2": 0.01})
    one = reduce(box, "4", "5").M12
    unit = reduce(replace(box, inertias={"input": 0.1, "output": 0.05, "R3-S4": 1.0}), "4", "5").M12
    assert one > 0.0 > unit
    inertias = {**box.inertias, "R3-S4": -one / unit}
    shift = reduce(replace(box, inertias=inertias), "4", "5")
    assert shift.exact
    assert len(shift.violations) == 2
    assert "cancel" in shift.describe_condition()


def test_the_spin_of_planets_is_counted_and_named() -> None:
    box = three_set()
    sets = (box.sets[0], replace(box.sets[1], planet_inertia=0.002), box.sets[2])
    shift = reduce(replace(box, sets=sets), "2", "3")
    (planets,) = shift.violations
    assert planets.member == "planets of P2"
    # ω_planet = ω_C - 2/(z - 1)·(ω_S - ω_C), at standstill of the output
    carrier = -1.0 / box.sets[2].z
    pinion = 2.0 / (box.sets[1].z - 1.0)
    assert planets.a == pytest.approx(carrier - pinion * (1.0 - carrier), rel=1e-9)


def mass(shift: Any, *, keep_coupling: bool) -> tuple[float, float, float]:
    """Mass matrix that the dual-clutch driveline has, without the engine."""
    model = shift.build_dual_clutch(keep_coupling=keep_coupling)
    drums = [(e.drum_inertia, e.i_c, e.i_out) for e in model.elements]
    engine = shift.gearbox.require_drive().engine_inertia
    return (
        model.J1 - engine + sum(drum / i_c**2 for drum, i_c, _ in drums),
        -sum(drum * i_out / i_c for drum, i_c, i_out in drums),
        model.J_out + sum(drum * i_out**2 for drum, _, i_out in drums),
    )


@pytest.mark.parametrize(
    "inertias", [{"R2_C1": 0.1}, {"R1": 0.1}, {"R1": 0.05, "R2_C1": 0.1, "R3_C2": 0.2}]
)
def test_drum_inertias_carry_the_whole_mass_matrix(inertias: dict[str, float]) -> None:
    shift = reduce(three_set(**inertias), "2", "3")
    expected = (shift.M11, shift.M12, shift.M22)
    assert mass(shift, keep_coupling=True) == pytest.approx(expected, rel=1e-12)
    left_out = (shift.M11, 0.0, shift.M22)
    assert mass(shift, keep_coupling=False) == pytest.approx(left_out, rel=1e-12)


def test_a_coupling_that_no_drum_can_carry_is_told() -> None:
    box = replace(load_gearbox("zf-8hp70"), inertias={"input": 0.1, "output": 0.05, "C3": 0.01})
    shift = reduce(box, "1", "2")
    assert shift.M12 > 0.0
    with pytest.raises(ReductionError, match="no drum inertia of C or E can carry"):
        shift.build_dual_clutch()


@pytest.mark.parametrize(
    ("name", "old", "new", "reason"),
    [
        ("three-set-3000", "2", "5", "released C1, C4; applied C2, C3"),
        ("three-set-3000", "2", "2", "released none; applied none"),
        ("zf-8hp70", "1", "8", "released B, C; applied D, E"),
        ("dual-clutch-7", "2", "2", "released none; applied none"),
    ],
)
def test_what_is_not_one_off_one_on_is_refused(name: str, old: str, new: str, reason: str) -> None:
    with pytest.raises(ReductionError, match=reason):
        reduce(load_gearbox(name), old, new)


def test_a_dual_clutch_gearbox_shifts_between_its_clutches_with_both_dogs_engaged() -> None:
    shift = reduce(load_gearbox("dual-clutch-7"), "2", "3")
    assert (shift.off_going.element, shift.on_coming.element) == ("K2", "K1")
    assert set(shift.common) == {"D2", "D3"}
    assert shift.exact
