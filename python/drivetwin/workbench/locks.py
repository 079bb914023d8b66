# SPDX-License-Identifier: MIT
"""Prior knowledge of parameters set by the user: free, uncertain or fixed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import StrEnum

from drivetwin._util.display_units import format_with_unit, get_display_unit
from drivetwin.errors import InputError, Where
from drivetwin.parameters import get_parameter_spec
from drivetwin.vehicle.spec import PriorValue
from drivetwin.vehicle.vehicle_card import VehicleCard


class LockKind(StrEnum):
    """Kind of prior knowledge of a parameter: unknown, uncertain or exact."""

    FREE = "free"
    PRIOR = "prior"
    FIXED = "fixed"


LOCKABLE = frozenset(
    {"eta", "J_prime", "J_out", "J_vehicle", "Tv_over_if", "k_o", "c_o", "te_delay", "P0"}
)
"""Stems of parameters that can be locked; the others follow from these."""
WIDE = 1e5
"""Least standard deviation [Pa] of a P0 that is free: a fill ends at some tenths of a bar to two
bar. Where the card's P0 is larger, so is the deviation."""


@dataclass(frozen=True)
class Lock:
    """Prior of a parameter: none, `value` ± `std` (1 sigma), or exactly `value`; SI."""

    kind: LockKind
    value: float = 0.0
    std: float = 0.0

    def to_prior(self) -> PriorValue:
        """As a design value."""
        return PriorValue(self.value, self.std if self.kind is LockKind.PRIOR else 0.0)


def can_fix(parameter_id: str) -> bool:
    """Return True if the parameter can be fixed."""
    try:
        return get_parameter_spec(parameter_id).stem in LOCKABLE
    except InputError:
        return False


def check_lock(parameter_id: str, lock: Lock) -> Lock:
    """Return the lock; raise InputError if the parameter does not support it."""
    spec = get_parameter_spec(parameter_id)
    where = Where(key=parameter_id)
    if spec.stem not in LOCKABLE:
        raise InputError("this follows from other parameters", "lock those", where)
    if lock.kind is not LockKind.FREE and not spec.lower <= lock.value <= spec.upper:
        raise InputError(
            f"{format_with_unit(lock.value, spec.unit)} lies outside "
            f"{format_with_unit(spec.lower, spec.unit)} to "
            f"{format_with_unit(spec.upper, spec.unit)}",
            "lock it at a possible value",
            where,
        )
    if lock.kind is LockKind.PRIOR and lock.std <= 0.0:
        raise InputError(
            "a prior needs a standard deviation above 0", "state one, or fix the value", where
        )
    return lock


def parse_lock(parameter_id: str, kind: LockKind, value: float | None, std: float | None) -> Lock:
    """The lock of numbers in display units; None where a field is empty.

    Raises InputError where no value is stated that is needed.
    """
    if kind is LockKind.FREE:
        return Lock(kind)
    if value is None:
        raise InputError("no value is stated", "type one first", Where(key=parameter_id))
    factor = get_display_unit(get_parameter_spec(parameter_id).unit).factor
    return Lock(kind, value / factor, (std or 0.0) / factor)


def get_card_lock(card: VehicleCard, parameter_id: str) -> Lock:
    """The lock that a card itself puts on a parameter."""
    prior = _get_card_prior(card, parameter_id)
    if prior is None:
        return Lock(LockKind.FREE)
    return Lock(LockKind.PRIOR if prior.std > 0.0 else LockKind.FIXED, prior.value, prior.std)


def apply_locks(card: VehicleCard, locks: Mapping[str, Lock]) -> VehicleCard:
    """The card as the locks have it. Raises InputError for a lock that cannot be."""
    for name, lock in locks.items():
        check_lock(name, lock)
        element = name.removeprefix("P0.")
        if name == "J_out":
            card = replace(card, J_out=None if lock.kind is LockKind.FREE else lock.to_prior())
        elif name.startswith("P0.") and element in card.elements:
            spec = card.elements[element]
            free = PriorValue(spec.P0.value, max(spec.P0.value, WIDE))
            P0 = free if lock.kind is LockKind.FREE else lock.to_prior()
            card = replace(card, elements={**card.elements, element: replace(spec, P0=P0)})
        elif lock.kind is LockKind.FREE:
            known = {key: value for key, value in card.known.items() if key != name}
            card = replace(card, known=known)
        else:
            card = replace(card, known={**card.known, name: lock.to_prior()})
    return replace(card, sha256="") if locks else card


def _get_card_prior(card: VehicleCard, parameter_id: str) -> PriorValue | None:
    if parameter_id == "J_out":
        return card.J_out
    if parameter_id.startswith("P0."):
        spec = card.elements.get(parameter_id.removeprefix("P0."))
        return None if spec is None else spec.P0
    return card.known.get(parameter_id)
