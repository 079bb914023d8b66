# SPDX-License-Identifier: MIT
"""Built-in gearboxes: their gears as a dual clutch, and those that have the ratios of a log."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from drivetwin.authoring.derive import list_forward_gears, match_gearboxes
from drivetwin.errors import CardError, InputError
from drivetwin.gearbox import list_builtin_gearboxes
from tests.authoring.sessions import load_session, make_draft

STATED = {
    "--final-drive": "4.88", "--engine-inertia": "4..20", "--vehicle-inertia": "2500..6500",
}  # fmt: skip
ELEMENTS = ["P0_bar=0.8,gain_m3=0.03"]


@pytest.mark.parametrize("name", list_builtin_gearboxes())
def test_a_gearbox_fits_its_own_ratios_first(name: str) -> None:
    ratios = [1.003 * ratio for ratio in list_forward_gears(name).values()]
    fits = match_gearboxes(ratios[1:3])
    assert fits[0].name == name
    assert fits[0].difference == pytest.approx(0.003, abs=1e-4)
    assert fits[0].gears == tuple(list_forward_gears(name))[1:3]


def test_strange_ratios_fit_no_gearbox() -> None:
    assert match_gearboxes([7.77, 1.2345]) == []
    assert match_gearboxes([]) == []


@pytest.mark.parametrize("name", list_builtin_gearboxes())
def test_neighbouring_gears_have_consistent_ratios(name: str, tmp_path: Path) -> None:
    for low, high in pairwise(list_forward_gears(name)):
        single = {**STATED, "--gearbox": name, "--gears": f"{high},{low}"}
        if name == "manual-6":
            with pytest.raises((CardError, InputError), match="dog"):
                make_draft(None, single, ELEMENTS)
            continue
        card = load_session(make_draft(None, single, ELEMENTS), tmp_path)
        assert [gear.name for gear in card.gears] == [low, high]
        for gear in card.gears:
            element = card.get_element(gear.elements[0])
            assert element.i_c is not None
            assert element.i_out is not None
            product = element.i_c.value * element.i_out.value
            assert product == pytest.approx(gear.ratio.value, rel=1e-5)


def test_gears_of_several_shifts_need_one_element_each(tmp_path: Path) -> None:
    single = {**STATED, "--gearbox": "three-set-3000", "--gears": "1,2,3,4"}
    card = load_session(make_draft(None, single, ELEMENTS), tmp_path)
    assert [gear.elements[0] for gear in card.gears] == ["C5", "C4", "C3", "C2"]
    for gears, said in (("1,2,3", "LOW,HIGH"), ("1,9", "no gear 9"), ("1", "alone")):
        with pytest.raises((CardError, InputError), match=said):
            make_draft(None, {**STATED, "--gearbox": "zf-8hp70", "--gears": gears}, ELEMENTS)
