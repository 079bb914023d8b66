# SPDX-License-Identifier: MIT
"""Locks become what the estimators know; those that make no sense are refused."""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import InputError
from drivetwin.vehicle.locks import (
    LOCKABLE,
    WIDE,
    Lock,
    LockKind,
    apply_locks,
    can_fix,
    check_lock,
    collect_locks,
    get_card_lock,
    list_lockable,
)
from drivetwin.vehicle.spec import PriorValue
from tests.report.sample import card as make_card

FIXED = LockKind.FIXED


@pytest.mark.parametrize("name", ["eta", "k_o", "c_o", "J_vehicle", "J_prime_2", "te_delay"])
def test_fixed_and_prior_are_known_beforehand(name: str) -> None:
    card = replace(make_card(), source="truck.toml", sha256="0")
    assert apply_locks(card, {name: Lock(FIXED, 0.9)}).known == {name: PriorValue(0.9)}
    assert apply_locks(card, {name: Lock(FIXED, 0.9)}).inputs == {}
    assert apply_locks(card, {}).inputs == card.inputs != {}
    prior = Lock(LockKind.PRIOR, 0.9, 0.1)
    assert apply_locks(card, {name: prior}).known == {name: PriorValue(0.9, 0.1)}
    assert apply_locks(apply_locks(card, {name: prior}), {name: Lock(LockKind.FREE)}).known == {}


def test_what_the_card_states_itself_is_replaced_there() -> None:
    card = make_card()
    element, spec = next(iter(card.elements.items()))
    locks = {"J_out": Lock(FIXED, 1.1), f"P0.{element}": Lock(LockKind.PRIOR, 7e4, 1e3)}
    fresh = apply_locks(card, locks)
    assert fresh.J_out == PriorValue(1.1)
    P0 = fresh.elements[element].P0
    assert (P0.value, P0.std) == (7e4, 1e3)
    free = apply_locks(card, {"J_out": Lock(LockKind.FREE), f"P0.{element}": Lock(LockKind.FREE)})
    assert free.J_out is None
    assert PriorValue(spec.P0.value, WIDE) == free.elements[element].P0


@pytest.mark.parametrize(("value", "std"), [(0.0, WIDE), (5e3, WIDE), (2.5e5, 2.5e5)])
def test_a_free_fill_pressure_is_no_known_one_whatever_the_card_says(
    value: float, std: float
) -> None:
    card = make_card()
    element, spec = next(iter(card.elements.items()))
    stated = replace(card, elements={element: replace(spec, P0=PriorValue(value))})
    assert get_card_lock(stated, f"P0.{element}") == Lock(FIXED, value)
    freed = apply_locks(stated, {f"P0.{element}": Lock(LockKind.FREE)})
    assert PriorValue(value, std) == freed.elements[element].P0


def test_the_lock_of_the_card_is_shown() -> None:
    card = make_card()
    assert get_card_lock(card, "eta") == Lock(LockKind.FREE)
    fresh = apply_locks(card, {"eta": Lock(FIXED, 0.9), "J_out": Lock(FIXED, 1.0)})
    assert get_card_lock(fresh, "eta") == Lock(FIXED, 0.9)
    assert get_card_lock(fresh, "J_out") == Lock(FIXED, 1.0)


@pytest.mark.parametrize(
    ("name", "lock"),
    [("f_d_3", Lock(FIXED, 10.0)), ("eta", Lock(FIXED, 7.0)), ("k_o", Lock(FIXED, -1.0)),
     ("eta", Lock(LockKind.PRIOR, 0.9, 0.0)), ("nonsense", Lock(FIXED, 1.0))],
)  # fmt: skip
def test_impossible_locks_are_refused(name: str, lock: Lock) -> None:
    with pytest.raises(InputError):
        check_lock(name, lock)


def test_what_follows_from_others_cannot_be_locked() -> None:
    assert can_fix("J_prime_3")
    assert can_fix("P0.B3")
    assert not can_fix("zeta_3")
    assert not can_fix("nonsense")


def test_names_are_those_of_the_card() -> None:
    names = list_lockable(make_card())
    assert {"eta", "J_prime_2", "J_prime_3", "P0.B2", "P0.B3", "J_out"} <= set(names)
    assert len(names) == len(set(names)) == len(LOCKABLE) + 2  # two gears, two elements
    assert all(map(can_fix, names))


def test_bounds_are_the_prior_with_the_moments_of_their_interval() -> None:
    locks = collect_locks(
        make_card(), {"eta": 0.97}, {"J_out": (0.9, 0.1)}, {"k_o": (1.0e5, 2.0e5)}
    )
    assert locks["eta"] == Lock(FIXED, 0.97)
    assert locks["J_out"] == Lock(LockKind.PRIOR, 0.9, 0.1)
    draws = np.linspace(1.0e5, 2.0e5, 100_001)
    assert locks["k_o"].kind is LockKind.PRIOR
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
