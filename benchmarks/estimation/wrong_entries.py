# SPDX-License-Identifier: MIT
"""Wrong entries of the vehicle card, one at a time, on one made log with known truth."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from benchmarks.estimation.mismatch_log import MismatchLog, Rates, make_mismatch_log
from benchmarks.estimation.validity import judge
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.identification import Identification
from drivetwin.findings import Code, Severity
from drivetwin.logs.quality.consistency_checks import check_final_drive
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.twin.build import build_twin
from drivetwin.validation.simulate_log import attach_validation
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.effects import EffectId
from drivetwin.vehicle.spec import PriorValue
from tools.result_blocks.accuracy import FAR

POUND_FOOT = 1.3558179483314004
"""N m per lb ft."""

Change = Callable[[ShiftLog, VehicleCard], tuple[ShiftLog, VehicleCard]]


@dataclass(frozen=True)
class WrongEntry:
    """One wrong entry, and a pattern that a finding which names it contains."""

    name: str
    change: Change
    named: str


def scale_gains(factor: float, *elements: str) -> Change:
    """Multiply the gain of some elements on the card."""

    def change(log: ShiftLog, card: VehicleCard) -> tuple[ShiftLog, VehicleCard]:
        changed = {
            name: replace(one, gain=one.gain.scale(factor)) if name in elements else one
            for name, one in card.elements.items()
        }
        return log, replace(card, elements=changed)

    return change


def scale_ratio(log: ShiftLog, card: VehicleCard) -> tuple[ShiftLog, VehicleCard]:
    """Raise the ratio of the second gear of the card by 1 %."""
    gears = list(card.gears)
    gears[1] = replace(gears[1], ratio=gears[1].ratio.scale(1.01))
    return log, replace(card, gears=tuple(gears))


def scale_final_drive(log: ShiftLog, card: VehicleCard) -> tuple[ShiftLog, VehicleCard]:
    """Raise the final drive by 3 %."""
    return log, replace(card, final_drive=card.final_drive.scale(1.03))


def raise_fill_pressure(log: ShiftLog, card: VehicleCard) -> tuple[ShiftLog, VehicleCard]:
    """Raise P0 of the on-coming element by 0.5 bar."""
    name = card.gears[1].elements[0]
    one = card.elements[name]
    raised = replace(one, P0=PriorValue(one.P0.value + 0.5e5, one.P0.std))
    return log, replace(card, elements={**card.elements, name: raised})


def swap_elements(log: ShiftLog, card: VehicleCard) -> tuple[ShiftLog, VehicleCard]:
    """Exchange the elements of both gears."""
    low, high = card.gears[:2]
    swapped = (replace(low, elements=high.elements), replace(high, elements=low.elements))
    return log, replace(card, gears=(*swapped, *card.gears[2:]))


def shift_ranges(log: ShiftLog, card: VehicleCard) -> tuple[ShiftLog, VehicleCard]:
    """State the inertia ranges of a vehicle three times as heavy."""
    prime, vehicle = card.J_prime_range, card.J_vehicle_range
    return log, replace(
        card,
        J_prime_range=(3.0 * prime[1], 6.0 * prime[1]),
        J_vehicle_range=(3.0 * vehicle[1], 6.0 * vehicle[1]),
    )


def change_channel(role: str, factor: float = 1.0, shift: float = 0.0) -> Change:
    """Multiply a channel and move its stamps."""

    def change(log: ShiftLog, card: VehicleCard) -> tuple[ShiftLog, VehicleCard]:
        one = log[role]
        moved = replace(one, time=one.time + shift, values=factor * one.values)
        return replace(log, channels={**log.channels, role: moved}), card

    return change


def keep(log: ShiftLog, card: VehicleCard) -> tuple[ShiftLog, VehicleCard]:
    """Change nothing: the drums of the vehicle are the entry that is missing."""
    return log, card


ENTRIES = (
    WrongEntry("gain of one clutch x10", scale_gains(10.0, "B3"), r"gain of B3"),
    WrongEntry("gain of one clutch x0.1", scale_gains(0.1, "B3"), r"gain of B3"),
    WrongEntry("gain of both x10", scale_gains(10.0, "B2", "B3"), r"gain of B[23]"),
    WrongEntry("gain of on-coming x1.4", scale_gains(1.4, "B3"), r"[gG]ain of B3|Friction of B3"),
    WrongEntry("gain of on-coming x0.7", scale_gains(0.7, "B3"), r"[gG]ain of B3|Friction of B3"),
    WrongEntry("gain of off-going x1.4", scale_gains(1.4, "B2"), r"Friction of B2"),
    WrongEntry("gain of off-going x0.7", scale_gains(0.7, "B2"), r"Friction of B2"),
    WrongEntry("gain of both x1.4", scale_gains(1.4, "B2", "B3"), r"Friction of B3"),
    WrongEntry("gain of both x0.7", scale_gains(0.7, "B2", "B3"), r"Friction of B3"),
    WrongEntry("ratio +1 %", scale_ratio, r"ratio"),
    WrongEntry("final drive +3 %", scale_final_drive, r"final_drive"),
    WrongEntry("P0 +0.5 bar", raise_fill_pressure, r"P0"),
    WrongEntry("elements swapped", swap_elements, r"swap|element|gain|pressure"),
    WrongEntry("drums not stated", keep, r"drum"),
    WrongEntry("inertia ranges of another vehicle", shift_ranges, r"range"),
    WrongEntry("engine torque with wrong sign", change_channel("engine_torque", -1.0), r"torque"),
    WrongEntry(
        "output torque in lb ft", change_channel("output_torque", 1.0 / POUND_FOOT), r"torque|unit"
    ),
    WrongEntry(
        "engine torque 60 ms early",
        change_channel("engine_torque", 1.0, -0.06),
        r"delay|te_delay|lag",
    ),
    WrongEntry("card of another vehicle", keep, r"card|ratio|gain"),
)


def describe_product(found: Identification, made: MismatchLog) -> str:
    """Return where the true μ times gain of B3 lies in its interval, and the verdict."""
    law = made.recorded.truth.friction["B3"]
    one, curve = found.estimates.get("mu_gain.B3"), found.friction.get("B3")
    if one is None or one.value is None or not one.std_total or curve is None:
        return "none"
    mu = float(law.evaluate(np.array([curve.middle_slip]))[0])
    true = made.card.elements["B3"].gain.value * mu
    return f"{(one.value - true) / one.std_total:+.1f} std, {one.verdict.value}"


def check_entry(number: int, seed: int) -> str:
    """Identify with one wrong entry, and return the outcome in words."""
    entry = ENTRIES[number]
    drums = EffectId.DRUM_INERTIA if entry.name.startswith("drums") else None
    made: MismatchLog = make_mismatch_log(seed, drums, 0.15 if drums else 0.0, Rates.LOGGER)
    log, card = entry.change(made.log, made.card)
    if entry.name.startswith("card of"):
        card = make_mismatch_log(seed + 1, None, 0.0, Rates.LOGGER).card
    read = (*log.findings, *check_final_drive(log.channels, card))  # as a reader of the file
    log = replace(log, findings=read)
    try:
        found = identify(log, card, detect_shifts(log, card))
        found = attach_validation(found, build_twin(found, card), log)
    except DrivetwinError as error:
        return f"{entry.name:36s} refused: {error.what}"
    product = describe_product(found, made)
    row = judge(seed, "", 0.0, found, made.recorded.truth.parameters)
    far = [f"{name} {z:+.0f}" for name, z in row.identified.items() if abs(z) > FAR]
    suspects = [one.text for one in found.findings if one.code is Code.CARD_SUSPECT]
    texts = suspects or [
        one.text
        for one in sorted(
            found.findings, key=lambda one: [*Severity].index(one.severity), reverse=True
        )
    ]
    place = next((k for k, text in enumerate(texts, 1) if re.search(entry.named, text)), 0)
    return (
        f"{entry.name:36s} {found.status.value:17s} identified {len(row.identified)}, far {far}, "
        f"named at place {place} of {len(texts)}; mu_gain.B3 {product}"
    )


def main() -> None:
    """Print the outcome of every wrong entry."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=2)
    parser.add_argument("--entries", default="", help="pattern of the names of entries; all")
    parser.add_argument("--workers", type=int, default=None)
    given = parser.parse_args()
    chosen = [k for k, one in enumerate(ENTRIES) if re.search(given.entries, one.name)]
    with ProcessPoolExecutor(given.workers) as pool:
        for line in pool.map(partial(check_entry, seed=given.seed), chosen):
            print(line, flush=True)


if __name__ == "__main__":
    main()
