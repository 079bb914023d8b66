# SPDX-License-Identifier: MIT
"""One gear at steady speed: speeds and torques of all members, lossless (THEORY section 1)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from drivetwin._native import gear_statics as native_gear_statics
from drivetwin.errors import InputError
from drivetwin.gearbox.network import as_json
from drivetwin.gearbox.spec import Gearbox


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
    """Solve one gear. Raises InputError where its elements do not make one ratio."""
    entry = gearbox.get_gear(gear)
    try:
        speeds, torques, (power, torque) = native_gear_statics(
            as_json(gearbox), list(entry.elements), gearbox.input, gearbox.output
        )
    except ValueError as error:
        raise InputError(
            f"gear {gear} of {gearbox.name}: {error}", "correct the gear's elements in the card"
        ) from error
    by_member = dict(speeds)
    return GearStatics(
        gear=gear,
        elements=entry.elements,
        ratio=1.0 / (by_member[gearbox.output] or float("nan")),
        speeds=by_member,
        flanges=tuple(Flange(*flange) for flange in torques),
        power_error=power,
        torque_error=torque,
    )
