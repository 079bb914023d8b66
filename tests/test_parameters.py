# SPDX-License-Identifier: MIT
"""Contract of every declared parameter, and the number of a log in an id."""

from __future__ import annotations

import math

import pytest

from drivetwin._util.display_units import format_with_unit
from drivetwin.errors import InputError
from drivetwin.estimation.result.verdict import get_experiment
from drivetwin.parameters import (
    BUS_SPECS,
    SPECS,
    ParameterSpec,
    get_parameter_spec,
    split_log_number,
)


@pytest.mark.parametrize(
    ("name", "plain", "number"),
    [
        ("te_delay", "te_delay", 0),
        ("te_delay.2", "te_delay", 2),
        ("Tv_over_if.12", "Tv_over_if", 12),
        ("Tv_over_if.1_over_eta", "Tv_over_if_over_eta", 1),
        ("P0.2", "P0.2", 0),
        ("J_prime_2", "J_prime_2", 0),
    ],
)
def test_the_number_of_a_log_is_taken_off(name: str, plain: str, number: int) -> None:
    assert split_log_number(name) == (plain, number)
    assert get_parameter_spec(name).stem == get_parameter_spec(plain).stem


def _make_id(spec: ParameterSpec) -> str:
    """Return an id of the parameter, with the suffix that it declares."""
    separator = {"": "", "gear": "_2", "element": ".B3", "channel": ".wheel_speed", "log": ".2"}
    return spec.stem + separator[spec.suffix]


@pytest.mark.parametrize("spec", [*SPECS.values(), *BUS_SPECS.values()], ids=lambda one: one.stem)
def test_a_parameter_is_declared_whole(spec: ParameterSpec) -> None:
    name = _make_id(spec)
    assert get_parameter_spec(name) is spec
    assert split_log_number(name) == ((spec.stem, 2) if spec.suffix == "log" else (name, 0))
    over_eta = get_parameter_spec(f"{name}_over_eta")
    assert (over_eta.unit, over_eta.symbol) == (spec.unit, f"{spec.symbol}/η")
    assert math.isfinite(spec.lower)
    assert spec.lower < spec.upper < math.inf
    assert spec.name
    assert not spec.name.lower().startswith(("the ", "a ", "an "))
    assert spec.meaning
    assert not set("*^") & set(format_with_unit(1.0, spec.unit))
    if spec.stem in SPECS:
        assert get_experiment(name).endswith(".")


@pytest.mark.parametrize("name", ["eta.1", "k_o.2", "nonsense"])
def test_what_logs_share_takes_no_number(name: str) -> None:
    with pytest.raises(InputError):
        get_parameter_spec(name)
