# SPDX-License-Identifier: MIT
"""Locks become what the estimators know; those that make no sense are refused."""

from __future__ import annotations

import math
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import InputError
from drivetwin.vehicle.locks import (
    apply_locks,
    collect_locks,
)
from drivetwin.vehicle.spec import PriorValue
from tests.report.sample import card as make_card


def test_bounds_are_the_prior_with_the_moments_of_their_interval() -> None:
    locks = collect_locks(
        make_card(), {"eta": 0.97}, {"J_out": (0.9, 0.1)}, {"k_o": (1.0e5, 2.0e5)}
    )
    known = apply_locks(make_card(), locks)
    assert known.known["eta"] == PriorValue(0.97)
    assert known.J_out == PriorValue(0.9, 0.1)
    draws = np.linspace(1.0e5, 2.0e5, 100_001)
    assert locks["k_o"].value == pytest.approx(np.mean(draws))
    assert locks["k_o"].std == pytest.approx(np.std(draws), rel=1e-4)


WRONG: dict[str, tuple[str, Any]] = {
    "unknown name": ("fixed", {"J_2": 0.1}),
    "gear of another box": ("fixed", {"J_prime_9": 20.0}),
    "element of another box": ("priors", {"P0.K1": (1e5, 1e4)}),
    "derived": ("fixed", {"zeta_3": 0.1}),
    "no text as a name": ("fixed", {3: 0.1}),
    "impossible": ("fixed", {"eta": 97.0}),
    "text": ("fixed", {"eta": "0.97"}),
    "nothing": ("fixed", {"eta": None}),
    "truth": ("fixed", {"eta": True}),
    "pair for a value": ("fixed", {"eta": (0.9, 0.1)}),
    "not a number": ("fixed", {"eta": math.nan}),
    "value for a pair": ("priors", {"eta": 0.97}),
    "three": ("priors", {"eta": (0.9, 0.1, 0.1)}),
    "text for a pair": ("priors", {"eta": "ab"}),
    "no deviation": ("priors", {"eta": (0.9, 0.0)}),
    "negative deviation": ("priors", {"eta": (0.9, -0.1)}),
    "infinite deviation": ("priors", {"eta": (0.9, math.inf)}),
    "swapped bounds": ("bounds", {"eta": (0.99, 0.9)}),
    "equal bounds": ("bounds", {"eta": (0.9, 0.9)}),
    "open bounds": ("bounds", {"eta": (0.9, None)}),
}


@pytest.mark.parametrize("case", WRONG)
def test_what_cannot_be_used_is_named(case: str) -> None:
    argument, stated = WRONG[case]
    given: dict[str, Any] = {"fixed": {}, "priors": {}, "bounds": {}, argument: stated}
    (name,) = stated
    with pytest.raises(InputError, match=f"1 of 1 (.|\\n)*{name}: ") as refused:
        collect_locks(make_card(), **given)
    assert "list_lockable" in refused.value.remedy


def test_all_faults_are_listed_at_once() -> None:
    with pytest.raises(InputError) as refused:
        collect_locks(
            make_card(), {"eta": 0.9, "J_prime": 20.0}, {"eta": (0.9, 0.1)}, {"k_0": (1.0, 2.0)}
        )
    text = str(refused.value)
    assert "3 of 4" in text
    assert "J_prime: not a parameter here; did you mean 'J_prime_" in text
    assert "eta: stated twice" in text
    assert "k_0: not a parameter here; did you mean 'k_o'?" in text


@given(st.dictionaries(st.text(max_size=8), st.floats() | st.text() | st.none(), max_size=4))
def test_any_mapping_is_taken_or_refused(stated: Any) -> None:
    for argument in ("fixed", "priors", "bounds"):
        given_one: dict[str, Any] = {"fixed": {}, "priors": {}, "bounds": {}, argument: stated}
        with suppress(InputError):
            assert collect_locks(make_card(), **given_one).keys() == stated.keys()
