# SPDX-License-Identifier: MIT
"""Locks become what the estimators know; those that make no sense are refused."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.errors import InputError
from drivetwin.vehicle.spec import PriorValue
from drivetwin.workbench.locks import (
    WIDE,
    Lock,
    LockKind,
    card_lock,
    checked,
    lockable,
    locked,
    typed,
)
from drivetwin.workbench.session import Session

FIXED = LockKind.FIXED


@pytest.mark.parametrize("name", ["eta", "k_o", "c_o", "J_vehicle", "J_prime_2", "te_delay"])
def test_fixed_and_prior_are_known_beforehand(identified: Session, name: str) -> None:
    card = identified.work.require_card()
    assert locked(card, {name: Lock(FIXED, 0.9)}).known == {name: PriorValue(0.9)}
    assert locked(card, {name: Lock(FIXED, 0.9)}).inputs == {}
    assert locked(card, {}).inputs == card.inputs != {}
    prior = Lock(LockKind.PRIOR, 0.9, 0.1)
    assert locked(card, {name: prior}).known == {name: PriorValue(0.9, 0.1)}
    assert locked(locked(card, {name: prior}), {name: Lock(LockKind.FREE)}).known == {}


def test_what_the_card_states_itself_is_replaced_there(identified: Session) -> None:
    card = identified.work.require_card()
    element, spec = next(iter(card.elements.items()))
    locks = {"J_out": Lock(FIXED, 1.1), f"P0.{element}": Lock(LockKind.PRIOR, 7e4, 1e3)}
    fresh = locked(card, locks)
    assert fresh.J_out == PriorValue(1.1)
    P0 = fresh.elements[element].P0
    assert (P0.value, P0.std) == (7e4, 1e3)
    free = locked(card, {"J_out": Lock(LockKind.FREE), f"P0.{element}": Lock(LockKind.FREE)})
    assert free.J_out is None
    assert PriorValue(spec.P0.value, WIDE) == free.elements[element].P0


@pytest.mark.parametrize(("value", "std"), [(0.0, WIDE), (5e3, WIDE), (2.5e5, 2.5e5)])
def test_a_free_fill_pressure_is_no_known_one_whatever_the_card_says(
    identified: Session, value: float, std: float
) -> None:
    card = identified.work.require_card()
    element, spec = next(iter(card.elements.items()))
    stated = replace(card, elements={element: replace(spec, P0=PriorValue(value))})
    assert card_lock(stated, f"P0.{element}") == Lock(FIXED, value)
    freed = locked(stated, {f"P0.{element}": Lock(LockKind.FREE)})
    assert PriorValue(value, std) == freed.elements[element].P0


def test_the_lock_of_the_card_is_shown(identified: Session) -> None:
    card = identified.work.require_card()
    assert card_lock(card, "eta") == Lock(LockKind.FREE)
    fresh = locked(card, {"eta": Lock(FIXED, 0.9), "J_out": Lock(FIXED, 1.0)})
    assert card_lock(fresh, "eta") == Lock(FIXED, 0.9)
    assert card_lock(fresh, "J_out") == Lock(FIXED, 1.0)


@pytest.mark.parametrize(
    ("name", "lock"),
    [("f_d_3", Lock(FIXED, 10.0)), ("eta", Lock(FIXED, 7.0)), ("k_o", Lock(FIXED, -1.0)),
     ("eta", Lock(LockKind.PRIOR, 0.9, 0.0)), ("nonsense", Lock(FIXED, 1.0))],
)  # fmt: skip
def test_impossible_locks_are_refused(name: str, lock: Lock) -> None:
    with pytest.raises(InputError):
        checked(name, lock)


def test_an_empty_field_is_no_value_of_zero() -> None:
    for kind in (FIXED, LockKind.PRIOR):
        with pytest.raises(InputError, match="no value is stated"):
            typed("J_out", kind, None, 0.1)
    assert typed("J_out", LockKind.FREE, None, None) == Lock(LockKind.FREE)
    assert typed("te_delay", FIXED, 0.0, None) == Lock(FIXED, 0.0)
    prior = typed("te_delay", LockKind.PRIOR, 10.0, 2.0)
    assert (prior.value, prior.std) == pytest.approx((0.010, 0.002))


def test_what_follows_from_others_cannot_be_locked() -> None:
    assert lockable("J_prime_3")
    assert lockable("P0.B3")
    assert not lockable("zeta_3")
    assert not lockable("nonsense")
