# SPDX-License-Identifier: MIT
"""Causes in the card or the channel mapping for which a log shows no shift."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations

import numpy as np

from drivetwin._util.arrays import Span
from drivetwin.channels.roles import make_pressure_role
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.channels.units import BAR
from drivetwin.errors import MissingChannelError, TimeError
from drivetwin.findings import Code, Finding, report
from drivetwin.shifts.candidate import detect_gear_runs
from drivetwin.shifts.held_ratios import RESTS, HeldRatio, find_held_ratios, is_ratio
from drivetwin.shifts.kinematics import (
    GearboxSpeeds,
    compute_gear_ratios,
    is_shared_pressure,
    resample_speeds,
)
from drivetwin.shifts.shift import ShiftSettings
from drivetwin.vehicle.vehicle_card import VehicleCard

_EDGE = 0.2
"""Share of a gear held that is left out at both ends: there the pressures of a shift act."""
_APART = 0.5
"""Least difference of the pressure of an element between two gears, over its range, by which it
holds one of them and is open in the other."""

Levels = Mapping[str, float]
"""Median pressure [Pa] by gear held."""


def find_causes(log: ShiftLog, card: VehicleCard) -> tuple[Finding, ...]:
    """Find pressures that are exchanged in the mapping, and a card of another gearbox.

    Empty where the log has no two speeds.
    """
    if card.converter is not None and "input_speed" not in log:
        return ()
    try:
        speeds = resample_speeds(log, card)
    except (MissingChannelError, TimeError):
        return ()
    return (*_find_exchanged(log, card, speeds), *_find_other_gearbox(card, speeds))


def _find_exchanged(log: ShiftLog, card: VehicleCard, speeds: GearboxSpeeds) -> Iterator[Finding]:
    """Yield a finding for each two elements of which each is open in its own gears and closed in
    those of the other."""
    spans = _list_spans(card, speeds)
    names = [name for name in card.elements if make_pressure_role(name) in log]
    levels = {name: _measure_levels(log, name, spans) for name in names}
    for first, second in combinations(names, 2):
        own, others = (
            [
                gear.name
                for gear in card.gears
                if gear.name in spans and one in gear.elements and other not in gear.elements
            ]
            for one, other in ((first, second), (second, first))
        )
        if not own or not others or is_shared_pressure(log, first, second):
            continue
        low, high = levels[first], levels[second]
        if _is_lower(log, first, low, own, others) and _is_lower(log, second, high, others, own):
            gear = own[0]
            shown = {"open": low[gear] / BAR, "closed": high[gear] / BAR}
            names_ = {"first": first, "second": second, "gear": gear}
            yield report(Code.PRESSURES_EXCHANGED, **names_, **shown)


def _list_spans(card: VehicleCard, speeds: GearboxSpeeds) -> dict[str, list[Span]]:
    """Inner spans [s] of the gears held, by gear."""
    spans: dict[str, list[Span]] = {}
    for run in detect_gear_runs(speeds, compute_gear_ratios(card), ShiftSettings()):
        if run.gear is not None:
            start, end = float(speeds.time[run.first]), float(speeds.time[run.last])
            edge = _EDGE * (end - start)
            spans.setdefault(run.gear, []).append((start + edge, end - edge))
    return spans


def _measure_levels(
    log: ShiftLog, element: str, spans: Mapping[str, list[Span]]
) -> dict[str, float]:
    channel = log.get_pressure(element)
    found = {}
    for gear, each in spans.items():
        inside = np.zeros(channel.time.size, np.bool_)
        for low, high in each:
            inside |= (channel.time >= low) & (channel.time <= high)
        known = channel.values[inside & np.isfinite(channel.values)]
        found[gear] = float(np.median(known)) if known.size else float("nan")
    return found


def _is_lower(
    log: ShiftLog, element: str, levels: Levels, own: list[str], others: list[str]
) -> bool:
    """Return True if an element has less pressure in its own gears than in those of another."""
    extent = float(np.ptp(log.get_pressure(element).values))
    return min(levels[one] for one in others) - max(levels[one] for one in own) > _APART * extent


def _find_other_gearbox(card: VehicleCard, speeds: GearboxSpeeds) -> list[Finding]:
    """Report all ratios that rest for `RESTS` and are on no gear of the card, in one finding."""
    found = [
        one
        for one in find_held_ratios(speeds, RESTS)
        if not any(is_ratio(one, gear.ratio) for gear in card.gears)
    ]
    return report_unknown_ratios(found, compute_gear_ratios(card))


def report_unknown_ratios(found: list[HeldRatio], ratios: Mapping[str, float]) -> list[Finding]:
    """Report the ratios that are `found` on no gear of the card, in one finding; empty without."""
    if not found:
        return []
    rests = ", ".join(f"{one.ratio:.4g} for {one.time:.1f} s" for one in found)
    gears = ", ".join(f"{name} {ratio:.4g}" for name, ratio in ratios.items())
    return [report(Code.RATIO_UNKNOWN, ratios=rests, gears=gears)]
