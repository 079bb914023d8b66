# SPDX-License-Identifier: MIT
"""Entries of a vehicle card that are unusual by themselves, and the limits of all such checks.

They find slips of the decimal point and of the unit.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from drivetwin.channels.units import BAR, RPM
from drivetwin.errors import Where
from drivetwin.findings import Code, Finding, report
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.card_fields import get_card_field
from drivetwin.vehicle.spec import ElementSpec

Limits = tuple[float, float]


@dataclass(frozen=True)
class PlausibilitySettings:
    """Limits of the comparison with other entries and with a log; see `card_fields.toml` for the
    usual ranges of single entries."""

    unequal_gains: float = 5.0
    """Factor between the gains of the elements of a gearbox from which one is in doubt."""
    output_share: float = 0.2
    """Largest share of Jo' in the vehicle's inertia at the output shaft."""
    drum_share: float = 0.5
    """Largest share of a drum in J'."""
    friction: Limits = (0.05, 0.2)
    """μ of a wet clutch; outside, the gain is wrong."""
    usual_friction: Limits = (0.075, 0.18)
    """μ of nearly all wet clutches, with the error of the estimate."""
    ratio_tolerance: float = 0.01
    """Relative difference of a ratio that rounding, slip and noise explain."""
    inertia_margin: float = 1.6
    """Factor by which the torque balance may leave the design range."""
    least_pressure: float = 0.3
    """Least pressure above P0 from which μ is computed [bar]."""
    least_torque: float = 0.15
    """Least torque, over the largest of the channel, from which μ is computed."""


PLAUSIBILITY = PlausibilitySettings()


def check_entries(card: VehicleCard) -> list[Finding]:
    """Return a finding for each entry outside its usual range.

    The place of a finding has the key of the entry, its numbers are `found`, `low` and `high` in
    the unit of the entry, and the `nearest` of a range of entries to these limits.
    """
    return [
        *_check_ratios(card),
        *_check_inertias(card),
        *(one for element in card.elements.values() for one in _check_element(card, element)),
        *_check_sensors(card),
    ]


def find_entry(card: VehicleCard, key: str) -> Where:
    """Return the place of an entry of the card."""
    return Where(file=card.source or None, key=key)


def _expect(
    card: VehicleCard,
    key: tuple[str, ...],
    *found: float,
    limits: Limits | None = None,
    place: str = "",
    why: str = "",
) -> Iterator[Finding]:
    """Report the first number outside the usual range of the field at `key`, if any.

    `limits` and `why` replace those of the field, `place` the place of its entry.
    """
    field = get_card_field(*key)
    low, high = limits or field.usual
    outside = [one for one in found if not low <= one <= high]
    if outside:
        where = find_entry(card, place or ".".join((*key[:-1], field.entry)))
        nearest = min(max(low, min(found)), max(found))
        shown = {"found": outside[0], "nearest": nearest, "low": low, "high": high}
        names = {"what": field.what, "why": why or field.why}
        yield report(Code(field.finding), "", where, **shown, **names)


def _check_ratios(card: VehicleCard) -> Iterator[Finding]:
    for index, gear in enumerate(card.gears):
        place = f"gears[{index}].ratio"
        yield from _expect(card, ("gears", "ratios"), gear.ratio.value, place=place)
    yield from _expect(card, ("i_in",), card.i_in.value)
    yield from _expect(card, ("final_drive",), card.final_drive.value)
    if "eta" in card.known:
        yield from _expect(card, ("eta",), card.known["eta"].value)


def _check_inertias(card: VehicleCard) -> Iterator[Finding]:
    usual = PLAUSIBILITY
    yield from _expect(card, ("inertia", "J_prime"), *card.J_prime_range)
    key = ("inertia", "J_vehicle")
    low, high = get_card_field(*key).usual
    if card.final_drive.value < 1.5:
        low /= 25.0  # referred to the output shaft
    mass = high / min(get_card_field("wheel_radius").usual) ** 2
    why = f"mass times wheel radius squared, with masses beyond {mass / 1e3:.0f} t outside"
    wrong = [*_expect(card, key, *card.J_vehicle_range, limits=(low, high), why=why)]
    yield from wrong
    if card.J_out is not None and not wrong:
        share = usual.output_share
        at_output = share * card.J_vehicle_range[1] / card.final_drive.value**2
        why = f"at most {share:.0%} of the vehicle's inertia at the output shaft"
        key, limits = ("inertia", "J_out"), (0.0, at_output)
        yield from _expect(card, key, card.J_out.value, limits=limits, why=why)


def _check_element(card: VehicleCard, element: ElementSpec) -> Iterator[Finding]:
    usual, shape = PLAUSIBILITY, element.geometry
    found = {"P0_bar": element.P0.value / BAR}
    if shape is None:
        found = {"gain_m3": element.gain.value, **found}
    else:
        sizes = (shape.surfaces, shape.derating, shape.area, shape.radius)
        names = ("surfaces", "derating", "area_m2", "radius_m")
        found = {**dict(zip(names, sizes, strict=True)), **found}
    for name, value in found.items():
        yield from _expect(card, ("elements", element.name, name), value)
    limits = (0.0, usual.drum_share * card.J_prime_range[1])
    key = ("elements", element.name, "drum_inertia_kgm2")
    why = f"at most {usual.drum_share:.0%} of J′"
    yield from _expect(card, key, element.drum_inertia.value, limits=limits, why=why)


def get_gain_key(element: ElementSpec) -> str:
    """Return the key of the entry that the gain of an element hangs on first."""
    name = "gain_m3" if element.geometry is None else "surfaces"
    return f"elements.{element.name}.{name}"


def _check_sensors(card: VehicleCard) -> Iterator[Finding]:
    for role, sensor in card.sensors.items():
        unit, size = (
            ("Nm", 1.0) if role.endswith("torque")
            else ("rpm", RPM) if role.endswith("speed")
            else ("bar", BAR)
        )  # fmt: skip
        for name, found in (
            ("gain_tolerance", sensor.gain),
            (f"offset_tolerance_{unit}", sensor.offset / size),
            ("delay_tolerance_ms", 1e3 * sensor.delay),
        ):
            yield from _expect(card, ("sensors", role, name), found)
