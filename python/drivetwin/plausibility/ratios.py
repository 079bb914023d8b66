# SPDX-License-Identifier: MIT
"""Ratios of the card against the speeds of a log."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import MissingChannelError, TimeError
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.plausibility.entries import PLAUSIBILITY, find_entry
from drivetwin.shifts.kinematics import GearboxSpeeds, resample_speeds
from drivetwin.shifts.shift import ShiftSettings
from drivetwin.vehicle.spec import PriorValue
from drivetwin.vehicle.vehicle_card import VehicleCard

WIDTH = 0.1
"""Width of the blocks [s] whose ratios are compared."""


@dataclass(frozen=True)
class HeldRatio:
    """A ratio of input and output speed, the time [s] for which it is held in all, and its standard
    deviation by the scatter of blocks."""

    ratio: float
    time: float
    std: float


def find_held_ratios(speeds: GearboxSpeeds, hold: float = PLAUSIBILITY.hold) -> list[HeldRatio]:
    """Find the ratios that the speeds hold, from high to low, without knowledge of the gears.

    Blocks of `WIDTH` are reduced to their ratio; neighbours of one ratio within half of the
    tolerance make a run, and runs of `hold` [s] and more count.
    """
    usual = PLAUSIBILITY
    size = max(2, speeds.count_samples(WIDTH, 2))
    count = speeds.time.size // size
    if count < 2:
        return []
    shape = (count, size)
    output = speeds.output[: count * size].reshape(shape).mean(axis=1)
    inlet = speeds.input[: count * size].reshape(shape).mean(axis=1)
    moving = output > ShiftSettings().min_output_speed
    ratio = np.divide(inlet, output, out=np.full(count, np.nan), where=moving)
    period = size * speeds.step
    found: list[HeldRatio] = []
    start = 0
    for stop in range(1, count + 1):
        if stop < count and abs(ratio[stop] / ratio[start] - 1) < 0.5 * usual.ratio_tolerance:
            continue
        run = ratio[start:stop]
        if run.size * period >= hold and np.isfinite(run).all() and run[0] > 0.0:
            # The median of normal values scatters by √(π/2) times their mean.
            std = float(np.sqrt(0.5 * np.pi) * np.std(run, ddof=1) / np.sqrt(run.size))
            found.append(HeldRatio(float(np.median(run)), run.size * period, std))
        start = stop
    return merge_equal_ratios(found)


def merge_equal_ratios(found: Iterable[HeldRatio]) -> list[HeldRatio]:
    """Merge ratios that differ by less than the tolerance; from high to low."""
    merged: list[HeldRatio] = []
    for one in sorted(found, key=lambda each: -each.ratio):
        last = merged[-1] if merged else None
        if last is not None and last.ratio / one.ratio - 1 < PLAUSIBILITY.ratio_tolerance:
            time = last.time + one.time
            shares = (last.time / time, one.time / time)
            ratio = shares[0] * last.ratio + shares[1] * one.ratio
            # What both runs differ by beyond noise, as with late speeds, stays in the mean.
            apart = shares[0] * shares[1] * abs(last.ratio - one.ratio)
            noise = np.hypot(shares[0] * last.std, shares[1] * one.std)
            merged[-1] = HeldRatio(ratio, time, float(max(noise, apart)))
        else:
            merged.append(one)
    return merged


def find_log_ratios(log: ShiftLog, card: VehicleCard) -> list[HeldRatio]:
    """Find the ratios held in a log; empty where it has no two speeds or an open converter."""
    if card.converter is not None and "input_speed" not in log:
        return []
    try:
        return find_held_ratios(resample_speeds(log, card))
    except (MissingChannelError, TimeError):
        return []


def is_held(ratio: float, held: Sequence[HeldRatio]) -> bool:
    """Return True if one of the ratios that are held is this one."""
    return any(abs(one.ratio / ratio - 1) <= PLAUSIBILITY.ratio_tolerance for one in held)


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
