# SPDX-License-Identifier: MIT
"""Ratios of the card against the speeds of a log."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import MissingChannelError, TimeError
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.plausibility.entries import PLAUSIBILITY, find_entry
from drivetwin.shifts.held_ratios import HeldRatio, find_held_ratios, is_held
from drivetwin.shifts.kinematics import resample_speeds
from drivetwin.shifts.shift import ShiftSettings
from drivetwin.vehicle.spec import PriorValue
from drivetwin.vehicle.vehicle_card import VehicleCard


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
