# SPDX-License-Identifier: MIT
"""All plausibility checks of a vehicle card, with or without a log."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from drivetwin.channels.roles import make_pressure_role
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.channels.units import BAR
from drivetwin.errors import MissingChannelError, TimeError
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.parameters import FINAL_DRIVE, make_ratio_id
from drivetwin.plausibility.entries import PLAUSIBILITY, check_entries, find_entry
from drivetwin.plausibility.friction import (
    check_friction,
    check_inertias,
    check_torque_signs,
    sample_span,
)
from drivetwin.shifts.detect import find_causes
from drivetwin.shifts.shift import (
    HeldRatio,
    Shift,
    ShiftSettings,
    find_held_ratios,
    is_held,
    resample_speeds,
)
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.spec import PriorValue

ABOVE = 1.2
"""Least ratio of the largest pressure of an element that engages to its P0."""
DRAG = 0.3
"""Pressure above P0 that an open element may have [bar]: sensor offset, prefill."""
AMBIENT, LOWEST = (0.85, 1.1), 0.05
"""Pressure of the air from 1,400 m to sea level, with the offset of a sensor [bar], and the share
of the samples below the resting pressure of an open element."""


def check_pressures(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift], doubted: frozenset[str]
) -> list[Finding]:
    """Report each P0 that the pressures of the log exclude; `doubted` elements are left out.

    An element is looked at where the log holds its gear or shifts to it.
    """
    findings = {
        element: finding
        for element, finding in (*_check_largest(log, card), *_check_open(log, card, shifts))
        if element not in doubted
    }
    return list(findings.values())


def _check_ambient(log: ShiftLog, card: VehicleCard) -> Iterator[Finding]:
    """Report pressures of which none falls below, and all fall to, that of the ambient air."""
    roles = [role for role in map(make_pressure_role, card.elements) if role in log]
    lowest = [float(np.nanquantile(log[role].values, LOWEST)) / BAR for role in roles]
    if len(lowest) > 1 and AMBIENT[0] < min(lowest) and max(lowest) < AMBIENT[1]:
        yield report(Code.PRESSURES_ABSOLUTE, low=min(lowest), high=max(lowest))


def _check_largest(log: ShiftLog, card: VehicleCard) -> Iterator[tuple[str, Finding]]:
    held = find_log_ratios(log, card)
    for name, element in card.elements.items():
        role = make_pressure_role(name)
        engages = any(
            name in gear.elements and is_held(gear.ratio.value, held) for gear in card.gears
        )
        if role not in log or not engages:
            continue
        largest, P0 = float(np.nanmax(log[role].values)), element.P0.value
        if largest < ABOVE * P0:
            shown = {"found": P0 / BAR, "low": 0.0, "high": largest / BAR}
            place = find_entry(card, f"elements.{name}.P0_bar")
            yield name, report(Code.CARD_FILL_ABOVE_LOG, "", place, element=name, **shown)


def _check_open(
    log: ShiftLog, card: VehicleCard, shifts: Sequence[Shift]
) -> Iterator[tuple[str, Finding]]:
    """Compare P0 with the pressure of each on-coming element well before its shift."""
    for shift in shifts:
        role = make_pressure_role(shift.oncoming)
        if role not in log or shift.oncoming == shift.offgoing:
            continue
        if log[role].source_name == _find_source(log, shift.offgoing):
            continue  # one pressure for both
        first, last = shift.before
        values = sample_span(log[role], (first, first + 0.7 * (last - first)))
        known = values[np.isfinite(values)]
        P0 = card.get_element(shift.oncoming).P0.value
        if known.size < 10 or (resting := float(np.median(known))) < P0 + DRAG * BAR:
            continue
        place = find_entry(card, f"elements.{shift.oncoming}.P0_bar")
        shown = {"found": P0 / BAR, "low": resting / BAR}
        names = {"element": shift.oncoming, "gear": shift.start_gear}
        yield shift.oncoming, report(Code.CARD_FILL_BELOW_LOG, "", place, **names, **shown)


def _find_source(log: ShiftLog, element: str) -> str:
    role = make_pressure_role(element)
    return log[role].source_name if role in log else ""


FROM_READING = {Code.FINAL_DRIVE_DIFFERS: "final_drive", Code.TORQUES_DIFFER: "gears"}
"""Findings of the log reader that concern the card, and the entry that they concern."""
ENGINE_INERTIA, OUTPUT_INERTIA = "inertia.J_prime_kgm2", "inertia.J_out_kgm2"


def drop_card_findings(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Return the findings of the log reader that do not concern a card."""
    return tuple(one for one in findings if one.code not in FROM_READING)


def check_card(
    card: VehicleCard, log: ShiftLog | None = None, shifts: Sequence[Shift] = ()
) -> tuple[Finding, ...]:
    """Return what is implausible on a vehicle card.

    Parameters
    ----------
    card : design data of a vehicle
    log : recording of the vehicle; without it the entries are compared with usual ranges only
    shifts : the shifts detected in `log`

    Returns
    -------
    Findings with the key of the entry as place and the numbers `found` and `low`, `high` or
    `expected` in the unit of the entry. What the reader of the log found is not repeated.
    """
    found = check_entries(card)
    if log is None:
        return tuple(found)
    if OUTPUT_INERTIA in {one.place.key for one in found}:
        card = replace(card, J_out=None)
    causes = (*find_causes(log, card), *_check_ambient(log, card), *check_torque_signs(log, card))
    differing = check_ratios(log, card)
    found += differing
    if any(one.code is Code.PRESSURES_EXCHANGED for one in causes):
        return (*found, *causes)  # what the pressures say of the card follows from the exchange
    found += check_pressures(log, card, shifts, list_doubted_elements(card, found))
    sound = [one for one in shifts if not _has_doubted_gear(one, card, found)]
    known = "output_torque" in log or ENGINE_INERTIA not in {one.place.key for one in found}
    if known:
        found += check_friction(log, card, sound, list_doubted_elements(card, found))
    keys = frozenset(one.place.key or "" for one in found)
    found += check_inertias(log, card, sound, keys)
    decided = {one.place.key: one for one in found}.values()  # the log decides
    other = [*causes] if len(differing) > 1 or not differing else []
    return (*decided, *other)


def select_card_findings(card: VehicleCard, findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Return the findings of the log reader that concern the card, at the place of the entry."""
    return tuple(
        replace(one, place=find_entry(card, FROM_READING[one.code]))
        for one in findings
        if one.code in FROM_READING
    )


def merge_ratios(
    card: VehicleCard, findings: Iterable[Finding], refined: Iterable[Finding]
) -> tuple[Finding, ...]:
    """Return the findings with one for each ratio.

    `refined` are those of the speeds of the shifts, by parameter id. They replace the others on
    the same ratio, which compare whole channels.
    """
    keys = {make_ratio_id(gear.name): f"gears[{k}].ratio" for k, gear in enumerate(card.gears)}
    keys[FINAL_DRIVE] = "final_drive"
    placed = [replace(one, place=find_entry(card, keys[one.subject])) for one in refined]
    known = {one.place.key for one in placed}
    return (*(one for one in findings if one.place.key not in known), *placed)


def list_doubted_elements(card: VehicleCard, found: Iterable[Finding]) -> frozenset[str]:
    """Return the elements of which an entry is in doubt already, other than the whole gain."""
    keys = [one.place.key or "" for one in found if one.code is not Code.CARD_GAIN_UNUSUAL]
    return frozenset(
        name for name in card.elements if any(key.startswith(f"elements.{name}.") for key in keys)
    )


def _has_doubted_gear(shift: Shift, card: VehicleCard, found: Iterable[Finding]) -> bool:
    keys = {one.place.key for one in found}
    return any(
        f"gears[{index}].ratio" in keys
        for index, gear in enumerate(card.gears)
        if gear.name in (shift.start_gear, shift.end_gear)
    )


def find_log_ratios(log: ShiftLog, card: VehicleCard) -> list[HeldRatio]:
    """Find the ratios held in a log; empty where it has no two speeds or an open converter."""
    if card.converter is not None and "input_speed" not in log:
        return []
    try:
        return find_held_ratios(resample_speeds(log, card))
    except (MissingChannelError, TimeError):
        return []


def check_ratios(log: ShiftLog, card: VehicleCard) -> list[Finding]:
    """Report each gear of the card that the log does not hold, if it holds one not on the card."""
    held = find_log_ratios(log, card)
    gears = dict(enumerate(card.gears))
    free = [one for one in held if not any(is_held(gear.ratio.value, [one]) for gear in card.gears)]
    absent = {index: gear for index, gear in gears.items() if not is_held(gear.ratio.value, held)}
    findings: list[Finding] = []
    while free and absent:
        index, nearest = min(
            ((index, one) for index in absent for one in free),
            key=lambda pair: abs(np.log(pair[1].ratio / absent[pair[0]].ratio.value)),
        )
        gear = absent.pop(index)
        free.remove(nearest)
        found, expected = (
            Number(one.value, "1", one.half_width)
            for one in (gear.ratio, PriorValue(nearest.ratio, nearest.std))
        )
        shown = {"found": found, "expected": expected, "time": Number(nearest.time)}
        place = find_entry(card, f"gears[{index}].ratio")
        findings.append(report(Code.CARD_RATIO_DIFFERS, "", place, gear=gear.name, **shown))
    return [*findings, *_check_input_gear(log, card)]


def _check_input_gear(log: ShiftLog, card: VehicleCard) -> Iterator[Finding]:
    """Compare i_in with engine and input speed, where no converter lies between them."""
    if card.converter is not None or not ("engine_speed" in log and "input_speed" in log):
        return
    engine, inlet = log["engine_speed"].updates, log["input_speed"].updates
    driven = inlet.interpolate(engine.time)
    known = np.isfinite(driven) & (driven > ShiftSettings().min_output_speed)
    if np.count_nonzero(known) < 20:
        return
    ratios = engine.values[known] / driven[known]
    low, middle, high = np.quantile(ratios, (0.1, 0.5, 0.9))
    if high - low > PLAUSIBILITY.ratio_tolerance * middle:
        return  # slipping: a converter that the card does not state
    if abs(middle / card.i_in.value - 1) > PLAUSIBILITY.ratio_tolerance:
        place = find_entry(card, "i_in")
        shown = {"found": card.i_in.value, "expected": float(middle)}
        yield report(Code.CARD_INPUT_GEAR_DIFFERS, "", place, **shown)
