# SPDX-License-Identifier: MIT
"""Entries of a vehicle card that are unusual by themselves: slips of decimal point and unit."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from drivetwin.channels.units import BAR, RPM
from drivetwin.errors import Where
from drivetwin.findings import Code, Finding, report
from drivetwin.plausibility.settings import PLAUSIBILITY, Limits
from drivetwin.vehicle.spec import ElementSpec, SensorTolerance
from drivetwin.vehicle.vehicle_card import VehicleCard


def check_entries(card: VehicleCard) -> list[Finding]:
    """Return a finding for each entry outside its usual range.

    The place of a finding has the key of the entry, its numbers are `found`, `low` and `high` in
    the unit of the entry.
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
    code: Code, place: Where, found: Iterable[float], limits: Limits, **names: str
) -> Iterator[Finding]:
    """Report the first number outside the limits, if any."""
    low, high = limits
    outside = [one for one in found if not low <= one <= high]
    if outside:
        yield report(code, "", place, found=outside[0], low=low, high=high, **names)


def _check_ratios(card: VehicleCard) -> Iterator[Finding]:
    usual = PLAUSIBILITY
    code = Code.CARD_RATIO_UNUSUAL
    for index, gear in enumerate(card.gears):
        place = find_entry(card, f"gears[{index}].ratio")
        yield from _expect(code, place, [gear.ratio.value], usual.ratio, what="a gear")
    place = find_entry(card, "i_in")
    yield from _expect(code, place, [card.i_in.value], usual.ratio, what="an input gear")
    place = find_entry(card, "final_drive")
    yield from _expect(
        code, place, [card.final_drive.value], usual.final_drive, what="a final drive"
    )
    if "eta" in card.known:
        found = [card.known["eta"].value]
        code = Code.CARD_EFFICIENCY_UNUSUAL
        yield from _expect(code, find_entry(card, "eta"), found, usual.efficiency)


def _check_inertias(card: VehicleCard) -> Iterator[Finding]:
    usual = PLAUSIBILITY
    code = Code.CARD_INERTIA_UNUSUAL
    what = "inertia at the engine (J′)"
    why = "0.1 of a small car to 40 of a heavy truck in a low gear"
    key = find_entry(card, "inertia.J_prime_kgm2")
    yield from _expect(code, key, card.J_prime_range, usual.engine_inertia, what=what, why=why)
    low, high = usual.vehicle_inertia
    if card.final_drive.value < 1.5:
        low /= 25.0  # referred to the output shaft
    masses = [low / max(usual.wheel_radius) ** 2, high / min(usual.wheel_radius) ** 2]
    what = "vehicle inertia at the wheel (J3)"
    why = f"mass times wheel radius squared, with masses beyond {masses[1] / 1e3:.0f} t outside"
    key = find_entry(card, "inertia.J_vehicle_kgm2")
    wrong = [*_expect(code, key, card.J_vehicle_range, (low, high), what=what, why=why)]
    yield from wrong
    if card.J_out is not None and not wrong:
        share = usual.output_share
        at_output = share * card.J_vehicle_range[1] / card.final_drive.value**2
        why = f"at most {share:.0%} of the vehicle's inertia at the output shaft"
        key = find_entry(card, "inertia.J_out_kgm2")
        what = "inertia of the output side (Jo′)"
        yield from _expect(code, key, [card.J_out.value], (0.0, at_output), what=what, why=why)


def _check_element(card: VehicleCard, element: ElementSpec) -> Iterator[Finding]:
    usual, root = PLAUSIBILITY, f"elements.{element.name}"
    shape = element.geometry
    if shape is None:
        key = find_entry(card, f"{root}.gain_m3")
        yield from _expect(Code.CARD_GAIN_UNUSUAL, key, [element.gain.value], usual.gain)
    else:
        for name, found, limits, what in (
            ("surfaces", shape.surfaces, usual.surfaces, "number of friction surfaces"),
            ("derating", shape.derating, usual.derating, "de-rating"),
            ("area_m2", shape.area, usual.area, "area of a friction surface"),
            ("radius_m", shape.radius, usual.radius, "effective radius"),
        ):
            key = find_entry(card, f"{root}.{name}")
            yield from _expect(Code.CARD_GEOMETRY_UNUSUAL, key, [found], limits, what=what)
    key = find_entry(card, f"{root}.P0_bar")
    found_P0 = [element.P0.value / BAR]
    yield from _expect(Code.CARD_PRESSURE_UNUSUAL, key, found_P0, usual.fill_pressure)
    high = usual.drum_share * card.J_prime_range[1]
    key = find_entry(card, f"{root}.drum_inertia_kgm2")
    why = f"at most {usual.drum_share:.0%} of J′"
    drum = [element.drum_inertia.value]
    what = "inertia of a clutch drum"
    yield from _expect(Code.CARD_INERTIA_UNUSUAL, key, drum, (0.0, high), what=what, why=why)


def get_gain_key(element: ElementSpec) -> str:
    """Return the key of the entry that the gain of an element hangs on first."""
    name = "gain_m3" if element.geometry is None else "surfaces"
    return f"elements.{element.name}.{name}"


def _check_sensors(card: VehicleCard) -> Iterator[Finding]:
    for role, sensor in card.sensors.items():
        for name, found, high, what in _list_tolerances(role, sensor):
            place = find_entry(card, f"sensors.{role}.{name}")
            code = Code.CARD_TOLERANCE_UNUSUAL
            yield from _expect(code, place, [found], (0.0, high), what=what)


def _list_tolerances(role: str, sensor: SensorTolerance) -> list[tuple[str, float, float, str]]:
    """Key, value, largest usual value and words of the tolerances of a sensor."""
    usual = PLAUSIBILITY
    if role.endswith("torque"):
        offset = ("offset_tolerance_Nm", sensor.offset, usual.torque_tolerance)
    elif role.endswith("speed"):
        offset = ("offset_tolerance_rpm", sensor.offset / RPM, usual.speed_tolerance)
    else:
        offset = ("offset_tolerance_bar", sensor.offset / BAR, usual.pressure_tolerance)
    return [
        ("gain_tolerance", sensor.gain, usual.gain_tolerance, "gain tolerance"),
        (*offset, "offset tolerance"),
        ("age_tolerance_ms", 1e3 * sensor.age, usual.age_tolerance, "tolerance of the age"),
    ]
