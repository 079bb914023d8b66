# SPDX-License-Identifier: MIT
"""Effects are checked by name and size."""

from __future__ import annotations

import pytest

from drivetwin.dyno.effects import check_effects, parse_effects
from drivetwin.errors import InputError
from drivetwin.vehicle.effects import EffectId


def test_texts_become_sizes_by_effect() -> None:
    effects = parse_effects(["tyre_slip=0.004", "input_drag=1e-2"])
    assert effects == {EffectId.TYRE_SLIP: 0.004, EffectId.INPUT_DRAG: 0.01}


@pytest.mark.parametrize("text", ["tyre_slip", "tyre_slip=", "tyre_slip=much", "=0.1"])
def test_another_form_is_refused(text: str) -> None:
    with pytest.raises(InputError):
        parse_effects([text])


def test_an_effect_stated_twice_is_refused() -> None:
    with pytest.raises(InputError, match="twice"):
        parse_effects(["input_drag=0.01", "input_drag=0.02"])


def test_unknown_names_are_listed_with_those_that_exist() -> None:
    with pytest.raises(InputError, match=r"'slip', 'drag'(?s:.*)tyre_slip, backlash"):
        check_effects({"slip": 0.1, "drag": 0.1, "input_drag": 0.1})


@pytest.mark.parametrize("size", [-0.1, float("nan"), float("inf")])
def test_impossible_sizes_are_listed(size: float) -> None:
    with pytest.raises(InputError, match=r"impossible.*slow_load = .*, brake_drag = "):
        check_effects({"slow_load": size, "input_drag": 0.1, "brake_drag": size})


def test_sizes_that_reverse_a_torque_are_refused() -> None:
    with pytest.raises(InputError, match="progressive_shaft below 2"):
        check_effects({"progressive_shaft": 2.0})


def test_two_laws_of_one_shaft_are_refused() -> None:
    with pytest.raises(InputError, match="one shaft"):
        check_effects({"backlash": 0.01, "progressive_shaft": 0.01})
