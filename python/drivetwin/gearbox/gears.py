# SPDX-License-Identifier: MIT
"""One gear at steady speed: speeds and torques of all members, lossless (THEORY section 1)."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

from drivetwin._native import gear_statics as native_gear_statics
from drivetwin.errors import InputError, NoFixedRatioError
from drivetwin.gearbox.network import as_json
from drivetwin.gearbox.spec import POWER_SPLIT_REMEDY, Gearbox
from drivetwin.simulation.element_schema import GROUND


@dataclass(frozen=True)
class Flange:
    """Torque that `element` exerts on `member` per unit input torque, positive with its speed."""

    element: str
    member: str
    torque: float


@dataclass(frozen=True)
class GearStatics:
    """A gear, driven with unit torque and unit speed at the input.

    `ratio` = ω_in/ω_out; `speeds` of all members, None for one that idles; `flanges` the torques
    of all sets, pairs and engaged elements on all members. `power_error` and `torque_error` are
    the largest sums of power through one element and of torque on one member: round-off.
    """

    gear: str
    elements: tuple[str, ...]
    ratio: float
    speeds: Mapping[str, float | None]
    flanges: tuple[Flange, ...]
    power_error: float
    torque_error: float

    def get_torque(self, element: str, member: str) -> float:
        """Torque of an element on a member per unit input torque; 0 where it has none."""
        return sum(f.torque for f in self.flanges if (f.element, f.member) == (element, member))

    def compute_power(self, element: str, member: str) -> float:
        """Power from an element into a member per unit input power."""
        return self.get_torque(element, member) * (self.speeds[member] or 0.0)


def describe_ratio_differences(gearbox: Gearbox, ratios: Mapping[str, float]) -> list[str]:
    """One sentence for each gear whose computed ratio, by its name, is not the published one."""
    entries = ((gearbox.get_gear(name), ratio) for name, ratio in ratios.items())
    return [
        f"gear {entry.name}: the computed ratio {ratio:.4f} is not the published "
        f"{entry.published:.6g} ± {entry.tolerance:.2g}: check teeth and elements, or state a "
        "tolerance"
        for entry, ratio in entries
        if not entry.matches_ratio(ratio)
    ]


def solve_gear(gearbox: Gearbox, gear: str) -> GearStatics:
    """Solve one gear.

    Raises NoFixedRatioError if its elements leave more than one speed free, InputError if they
    make no ratio otherwise or a freewheel works against its direction.
    """
    entry = gearbox.get_gear(gear)
    try:
        speeds, torques, (power, torque) = native_gear_statics(
            as_json(gearbox), list(entry.elements), gearbox.input, gearbox.output
        )
    except ValueError as error:
        raise _describe_refusal(gearbox, gear, error) from error
    by_member = dict(speeds)
    statics = GearStatics(
        gear=gear,
        elements=entry.elements,
        ratio=1.0 / (by_member[gearbox.output] or float("nan")),
        speeds=by_member,
        flanges=tuple(Flange(*flange) for flange in torques),
        power_error=power,
        torque_error=torque,
    )
    _check_freewheels(gearbox, statics)
    return statics


_FREE_SPEEDS = re.compile(r"(\d+) free speeds remain where 1 must")


def _describe_refusal(gearbox: Gearbox, gear: str, error: ValueError) -> InputError:
    """Return the error of a gear that makes no ratio; the core's text counts the free speeds."""
    what, remedy = (
        f"gear {gear} of {gearbox.name}: {error}",
        "correct the gear's elements in the card",
    )
    counted = _FREE_SPEEDS.search(str(error))
    if counted and int(counted[1]) > 1:
        return NoFixedRatioError(what, f"{remedy}, or {POWER_SPLIT_REMEDY}")
    return InputError(what, remedy)


_ROUND_OFF = 1e-9
"""Torque or speed per unit at the input that counts as none."""


def _check_freewheels(gearbox: Gearbox, statics: GearStatics) -> None:
    """Refuse a gear in which a freewheel drives backwards or overruns forwards."""
    for name in gearbox.freewheels:
        element = gearbox.elements[name]
        a, b = (0.0 if end == GROUND else statics.speeds[end] for end in (element.a, element.b))
        if name in statics.elements:
            pushed = statics.get_torque(name, element.b) - statics.get_torque(name, element.a)
            fault = f"would have to take torque from {element.b}" if pushed < -_ROUND_OFF else ""
        else:
            slip = 0.0 if a is None or b is None else a - b
            fault = f"would block {element.a} against {element.b}" if slip > _ROUND_OFF else ""
        if fault:
            raise InputError(
                f"gear {statics.gear} of {gearbox.name}: the freewheel {name} {fault}",
                f"swap the members of elements.{name}: the first drives the second forward; a "
                "single member cannot turn backwards",
            )
