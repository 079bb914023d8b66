# SPDX-License-Identifier: MIT
"""Ids of parameters: what is declared, and the number of a log in one."""

from __future__ import annotations

import pytest

from drivetwin.errors import InputError
from drivetwin.estimation.result.verdict import get_experiment
from drivetwin.parameters import SPECS, get_parameter_spec, split_log_number


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


def test_every_parameter_has_an_experiment_that_narrows_it() -> None:
    assert all(get_experiment(stem).endswith(".") for stem in SPECS)


@pytest.mark.parametrize("name", ["eta.1", "k_o.2", "nonsense"])
def test_what_logs_share_takes_no_number(name: str) -> None:
    with pytest.raises(InputError):
        get_parameter_spec(name)
