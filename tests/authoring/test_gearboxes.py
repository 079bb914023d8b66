# SPDX-License-Identifier: MIT
"""Built-in gearboxes: their gears as a dual clutch, and those that have the ratios of a log."""

from __future__ import annotations

from itertools import pairwise

import pytest

from drivetwin.authoring.gearboxes import (
    list_forward_gears,
    match_gearboxes,
    reduce_gears,
    refuse_irreducible,
)
from drivetwin.errors import CardError
from drivetwin.gearbox import list_builtin_gearboxes


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
def test_neighbouring_gears_have_consistent_ratios(name: str) -> None:
    gears = tuple(list_forward_gears(name))
    for low, high in pairwise(gears):
        if name == "manual-6":
            with pytest.raises(CardError, match="dog"):
                reduce_gears(name, (low, high))
            continue
        elements = reduce_gears(name, (high, low))
        assert [one.gear for one in elements] == [low, high]
        for one in elements:
            assert one.i_c * one.i_out == pytest.approx(one.ratio, rel=1e-5)


def test_a_gearbox_of_dogs_alone_is_refused_as_a_whole() -> None:
    for name in list_builtin_gearboxes():
        if name == "manual-6":
            with pytest.raises(CardError, match="dog"):
                refuse_irreducible(name)
        else:
            refuse_irreducible(name)


def test_gears_of_several_shifts_need_one_element_each() -> None:
    four = reduce_gears("three-set-3000", ("1", "2", "3", "4"))
    assert [one.element for one in four] == ["C5", "C4", "C3", "C2"]
    with pytest.raises(CardError, match="LOW,HIGH"):
        reduce_gears("zf-8hp70", ("1", "2", "3"))
    with pytest.raises(CardError, match="no gear 9"):
        reduce_gears("zf-8hp70", ("1", "9"))
    with pytest.raises(CardError, match="alone"):
        reduce_gears("zf-8hp70", ("1",))
