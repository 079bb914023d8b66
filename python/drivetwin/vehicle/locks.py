# SPDX-License-Identifier: MIT
"""Prior knowledge of parameters set by the user: free, uncertain or fixed.

The workbench and `drivetwin.identify` put it on the vehicle card before an identification.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from numbers import Real
from typing import Annotated

from pydantic import Field

from drivetwin._util.display_units import format_with_unit
from drivetwin.errors import InputError, Where, suggest_spelling
from drivetwin.parameters import SPECS, get_parameter_spec
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.spec import PriorValue


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
    std: Annotated[float, Field(ge=0)] = 0.0

    def to_prior(self) -> PriorValue:
        """As a design value."""
        return PriorValue(self.value, self.std if self.kind is LockKind.PRIOR else 0.0)


def can_fix(parameter_id: str) -> bool:
    """Return True if the parameter can be fixed."""
    try:
        return get_parameter_spec(parameter_id).stem in LOCKABLE
    except InputError:
        return False


def list_lockable(card: VehicleCard) -> list[str]:
    """Return the parameters of a vehicle that can be fixed or have a prior."""
    names: list[str] = []
    for stem in sorted(LOCKABLE):
        match SPECS[stem].suffix:
            case "gear":
                names += [f"{stem}_{gear.name}" for gear in card.gears]
            case "element":
                names += [f"{stem}.{element}" for element in card.elements]
            case _:
                names.append(stem)
    return names


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
    if lock.kind is LockKind.PRIOR and not lock.std > 0.0:
        raise InputError(
            "a prior needs a standard deviation above 0", "state one, or fix the value", where
        )
    return lock


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


def collect_locks(
    card: VehicleCard,
    fixed: Mapping[str, float],
    priors: Mapping[str, tuple[float, float]],
    bounds: Mapping[str, tuple[float, float]],
) -> dict[str, Lock]:
    """Return the locks of fixed values, priors and bounds, all by parameter id and in SI.

    A prior is a value and its standard deviation. Bounds are two ends between which all values are
    equally probable: the prior has the same mean and standard deviation, width/√12. Raises one
    InputError that lists every fault with its name.
    """
    stated = [
        *((name, LockKind.FIXED, value) for name, value in fixed.items()),
        *((name, LockKind.PRIOR, value) for name, value in priors.items()),
        *((name, None, value) for name, value in bounds.items()),
    ]
    known = list_lockable(card)
    locks: dict[str, Lock] = {}
    faults: list[str] = []
    for name, kind, value in stated:
        try:
            if name not in known:
                raise InputError(f"not a parameter here{suggest_spelling(str(name), known)}", "")
            if name in locks:
                raise InputError("stated twice", "")
            locks[name] = check_lock(name, _build_lock(kind, value))
        except InputError as fault:
            faults.append(f"{name}: {fault.what}")
    if faults:
        listed = "".join(f"\n  - {fault}" for fault in faults)
        what = f"{len(faults)} of {len(stated)} fixed values, priors and bounds cannot be used"
        raise InputError(
            what + listed,
            "give possible values in SI, each name once; "
            "drivetwin.vehicle.locks.list_lockable(card) lists the names",
        )
    return locks


def _build_lock(kind: LockKind | None, value: object) -> Lock:
    """Return the lock of a value, of (value, std), or without `kind` of (lower, upper)."""
    numbers = [value] if kind is LockKind.FIXED else value
    count = 1 if kind is LockKind.FIXED else 2
    if not isinstance(numbers, Sequence) or isinstance(numbers, str) or len(numbers) != count:
        what = "(value, standard deviation)" if kind else "(lower, upper)"
        raise InputError(f"{value!r} is not a pair {what}", "")
    for one in numbers:
        if isinstance(one, bool) or not isinstance(one, Real) or not math.isfinite(one):
            raise InputError(f"{one!r} is no finite number", "")
    first, *second = (float(one) for one in numbers)
    if kind is LockKind.FIXED:
        return Lock(kind, first)
    if kind is LockKind.PRIOR:
        return Lock(kind, first, second[0])
    if not first < second[0]:
        raise InputError(f"the bounds {first:g} and {second[0]:g} leave no room", "")
    return Lock(LockKind.PRIOR, 0.5 * (first + second[0]), (second[0] - first) / math.sqrt(12.0))
