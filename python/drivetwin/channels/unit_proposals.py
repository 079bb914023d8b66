# SPDX-License-Identifier: MIT
"""Proposals of units from values: which units make the numbers of a channel usual for its role.

A proposal is shown to the user and never used by itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from drivetwin.channels.roles import get_quantity
from drivetwin.channels.shiftlog import Quantity
from drivetwin.channels.units import find_unit, get_time_factor
from drivetwin.errors import Where

Range = tuple[float, float]

_USUAL: dict[str, Range] = {
    "engine_torque": (30.0, 5e3),
    "output_torque": (100.0, 8e4),
    "input_speed": (60.0, 900.0),
    "engine_speed": (60.0, 900.0),
    "output_speed": (10.0, 900.0),
    "wheel_speed": (4.0, 130.0),
    "throttle": (0.2, 1.1),
}
"""Usual largest magnitude of each role over a log with shifts [SI]."""

_USUAL_PRESSURE: Range = (1.5e5, 4e6)
"""Usual largest pressure of a shift element [Pa]."""

_UNITS: dict[Quantity, tuple[str, ...]] = {
    Quantity.TORQUE: ("Nm", "kNm"),
    Quantity.SPEED: ("rpm", "rad/s"),
    Quantity.PRESSURE: ("bar", "Pa", "kPa", "MPa"),
    Quantity.FRACTION: ("%", "-"),
}
"""Units that are proposed, the most frequent first."""

_LEAST_PERCENT = 1.5
"""Largest number of a pedal above which it is in percent, below a fraction."""

_MOST_PERCENT_TORQUE = 130.0
"""Largest number of an engine torque up to which it may be in percent of the reference torque."""

_MOST_REVERSED = 0.1
"""Largest part of the values on the other side of zero of a speed, pressure or pedal."""

_TIME_UNITS = ("s", "ms", "us")
_USUAL_STEP: Range = (2e-5, 0.25)
"""Usual time between samples of a log with shifts [s]."""


@dataclass(frozen=True)
class Proposal:
    """A unit that makes the values usual, and the reason in words; 0 is the most usual `rank`."""

    unit: str
    reason: str
    rank: int = 0


def propose_units(role: str, span: Range | None) -> tuple[Proposal, ...]:
    """Return the units that make the values of a role usual, the most frequent first.

    Parameters
    ----------
    role : str
        Role of the channel.
    span : tuple of float or None
        Least and largest number in the file; None where the channel has no number.
    """
    quantity = get_quantity(role)
    if span is None or quantity not in _UNITS:
        return ()
    low, high = span
    largest, smallest = max(abs(low), abs(high)), min(abs(low), abs(high))
    both_signs = low < 0.0 < high and smallest > _MOST_REVERSED * largest
    if both_signs and quantity is not Quantity.TORQUE:
        return ()
    usual = _USUAL_PRESSURE if quantity is Quantity.PRESSURE else _USUAL.get(role)
    if usual is None:
        return ()
    least, most = usual
    factors = {unit: _get_factor(unit) for unit in _UNITS[quantity]}
    fitting = [unit for unit, factor in factors.items() if least <= factor * largest <= most]
    if quantity is Quantity.FRACTION:
        fitting = [one for one in fitting if (one == "%") == (largest > _LEAST_PERCENT)]
    unusual = [unit for unit in factors if unit not in fitting]
    return tuple(
        Proposal(unit, _explain(role, span, unit, unusual), rank)
        for rank, unit in enumerate(factors)
        if unit in fitting
    )


def propose_missing_units(
    spans: Mapping[str, Range | None],
) -> dict[str, tuple[Proposal, ...]]:
    """Return the proposals for all channels of a log whose unit is open, by role.

    The one source of proposals: of the error that refuses the log, and of the mapping that is
    written.

    Parameters
    ----------
    spans : mapping of str to tuple of float or None
        Least and largest number in the file by role; None where the channel has no number.
    """
    return prefer_common_units({role: propose_units(role, span) for role, span in spans.items()})


def prefer_common_units(
    proposals: Mapping[str, tuple[Proposal, ...]],
) -> dict[str, tuple[Proposal, ...]]:
    """Return the proposals by role, with those alone that agree with the other channels.

    Of several proposals of a role one remains if it is the only proposal of all other channels of
    the quantity that have a single one.
    """
    sure: dict[Quantity, set[str]] = {}
    for role, some in proposals.items():
        if len(some) == 1:
            sure.setdefault(get_quantity(role), set()).add(some[0].unit)
    preferred = dict(proposals)
    for role, some in proposals.items():
        common = sure.get(get_quantity(role), set())
        agreeing = [one for one in some if {one.unit} == common]
        if len(some) > 1 and agreeing:
            reason = f"{agreeing[0].reason}; the other {get_quantity(role)} channels are in it too"
            preferred[role] = (Proposal(agreeing[0].unit, reason),)
    return preferred


def propose_time_units(step: float) -> tuple[Proposal, ...]:
    """Return the units of time that make the `step` between samples, in file numbers, usual."""
    least, most = _USUAL_STEP
    rates = {unit: step * get_time_factor(unit, Where()) for unit in _TIME_UNITS}
    return tuple(
        Proposal(unit, f"steps of {step:.4g} are then {1.0 / seconds:.4g} samples per second")
        for unit, seconds in rates.items()
        if least <= seconds <= most
    )


def _get_factor(unit: str) -> float:
    found = find_unit(unit)
    assert found is not None
    return found.factor


def _explain(role: str, span: Range, unit: str, unusual: list[str]) -> str:
    """Return the reason of a proposal."""
    low, high = span
    text = f"{low:.4g} to {high:.4g} is usual in {unit}"
    if unusual:
        text += f", not in {' or '.join(unusual)}"
    else:
        text += ", but other units are possible"
    if role == "engine_torque" and unit == "Nm" and high <= _MOST_PERCENT_TORQUE:
        text += "; in percent of a reference torque give scale = reference torque/100"
    return text
