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
    apply_locks,
    can_fix,
    check_lock,
    get_card_lock,
    parse_lock,
)
from drivetwin.workbench.session import Session

FIXED = LockKind.FIXED


@pytest.mark.parametrize("name", ["eta", "k_o", "c_o", "J_vehicle", "J_prime_2", "te_delay"])
def test_fixed_and_prior_are_known_beforehand(identified: Session, name: str) -> None:
    card = identified.work.require_card()
    assert apply_locks(card, {name: Lock(FIXED, 0.9)}).known == {name: PriorValue(0.9)}
    assert apply_locks(card, {name: Lock(FIXED, 0.9)}).inputs == {}
    assert apply_locks(card, {}).inputs == card.inputs != {}
    prior = Lock(LockKind.PRIOR, 0.9, 0.1)
    assert apply_locks(card, {name: prior}).known == {name: PriorValue(0.9, 0.1)}
    assert apply_locks(apply_locks(card, {name: prior}), {name: Lock(LockKind.FREE)}).known == {}


def test_what_the_card_states_itself_is_replaced_there(identified: Session) -> None:
    card = identified.work.require_card()
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
    identified: Session, value: float, std: float
) -> None:
    card = identified.work.require_card()
    element, spec = next(iter(card.elements.items()))
    stated = replace(card, elements={element: replace(spec, P0=PriorValue(value))})
    assert get_card_lock(stated, f"P0.{element}") == Lock(FIXED, value)
    freed = apply_locks(stated, {f"P0.{element}": Lock(LockKind.FREE)})
    assert PriorValue(value, std) == freed.elements[element].P0


def test_the_lock_of_the_card_is_shown(identified: Session) -> None:
    card = identified.work.require_card()
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


def test_an_empty_field_is_no_value_of_zero() -> None:
    for kind in (FIXED, LockKind.PRIOR):
        with pytest.raises(InputError, match="no value is stated"):
            parse_lock("J_out", kind, None, 0.1)
    assert parse_lock("J_out", LockKind.FREE, None, None) == Lock(LockKind.FREE)
    assert parse_lock("te_delay", FIXED, 0.0, None) == Lock(FIXED, 0.0)
    prior = parse_lock("te_delay", LockKind.PRIOR, 10.0, 2.0)
    assert (prior.value, prior.std) == pytest.approx((0.010, 0.002))


def test_what_follows_from_others_cannot_be_locked() -> None:
    assert can_fix("J_prime_3")
    assert can_fix("P0.B3")
    assert not can_fix("zeta_3")
    assert not can_fix("nonsense")
