# SPDX-License-Identifier: MIT
"""Coverage of intervals on made vehicles whose cards have the numbers that people write."""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.estimation.mismatch_log import MismatchLog, Rates, read_back, record_vehicle
from benchmarks.estimation.rough_card import write_card
from benchmarks.estimation.rough_log import RoughLog
from benchmarks.estimation.unlisted import UNLISTED, UnlistedId, add_unlisted
from benchmarks.estimation.validity import (
    correct_delay,
    find_size,
    identify_validated,
    judge_values,
    withhold,
)
from benchmarks.raw_results import add_options, finish_study
from benchmarks.rows import append_row, read_rows
from drivetwin.dyno.dyno import DynoRun
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.estimation.result.estimate import Z95, Verdict
from drivetwin.vehicle.effects import EffectId

OBEYING, LISTED, UNLISTED_GROUP, TWICE = "obeying", "listed", "unlisted", "twice as rough"
"""Groups of the count."""
MU_PLACES = (0.1, 0.5, 0.9)
"""Places of the compared points of a friction curve, over its slips."""
MU_GAIN = "mu_gain."
"""Begin of the id of the product of friction and gain of an element."""
RATIOS = ("ratio_", "i_f")
"""Begins of the ids of ratios and of the final drive."""
CURVE_EFFECTS = (EffectId.FRICTION_SHAPE, EffectId.FRICTION_PRESSURE, EffectId.FRICTION_HEAT)
"""Effects after which the truth has no friction curve."""
STANDARD_VALUES = 13
"""Number of values that could be identified of a vehicle that was not made."""


@dataclass(frozen=True)
class Plan:
    """Mismatch and roughness of the vehicle of a seed; `withheld` effects are off on the card."""

    group: str
    factor: float
    effect: EffectId | None
    withheld: bool
    unlisted: UnlistedId | None

    @property
    def mismatch(self) -> str:
        """Name of the mismatch, empty without one."""
        if self.effect is not None:
            return f"{self.effect.value}{' withheld' if self.withheld else ''}"
        return "" if self.unlisted is None else self.unlisted.value


def plan_vehicle(seed: int) -> Plan:
    """Plan the vehicle of a seed.

    Of four seeds two obey the model, one departs by an effect of the table and one by a mismatch
    from outside it: in turn an effect that the card switches off, and an error of a sensor or map
    that no effect describes. One seed of ten has a card that is twice as rough.
    """
    turn, kind = divmod(seed, 4)
    is_rough = seed % 10 == turn % 10
    effect, unlisted = None, None
    if kind == 1:
        effect = list(EFFECTS)[turn % len(EFFECTS)]
    elif kind == 3 and turn % 2:
        effect = list(EFFECTS)[turn // 2 % len(EFFECTS)]
    elif kind == 3:
        unlisted = list(UNLISTED)[turn // 2 % len(UNLISTED)]
    own = {1: LISTED, 3: UNLISTED_GROUP}.get(kind, OBEYING)
    group = TWICE if is_rough else own
    return Plan(group, 2.0 if is_rough else 1.0, effect, kind == 3, unlisted)


def study_vehicle(seed: int) -> RoughLog:
    """Identify the log of a made vehicle by its rough card and judge the result."""
    plan, start = plan_vehicle(seed), time.monotonic()
    size, possible = 0.0, 0
    try:
        made, size = make_vehicle(seed, plan)
        possible = len(made.recorded.truth.parameters)
        hidden = [plan.effect] if plan.withheld and plan.effect is not None else []
        card = withhold(made.card, *hidden)
        found = identify_validated(made.log, card)
    except DrivetwinError as error:
        taken = time.monotonic() - start
        return RoughLog(
            seed, plan.group, plan.mismatch, size, "no result", possible or STANDARD_VALUES,
            failure=" ".join(error.what.split()), seconds=taken,
        )  # fmt: skip
    truth = correct_delay(made.recorded.truth.parameters, plan.effect, size)
    values = judge_values(found, truth)
    products = {} if plan.effect in CURVE_EFFECTS else judge_products(found, made.recorded)
    stated = {} if plan.effect in CURVE_EFFECTS else judge_friction(found, made)
    return RoughLog(
        seed,
        plan.group,
        plan.mismatch,
        size,
        found.status.value,
        possible,
        values[Verdict.IDENTIFIED],
        values[Verdict.WEAK],
        judge_values(found, _list_ratios(made.recorded))[Verdict.IDENTIFIED],
        products,
        sum(name.startswith(MU_GAIN) for name in found.estimates),
        stated,
        found.evidence.gave_up,
        time.monotonic() - start,
    )


def make_vehicle(seed: int, plan: Plan) -> tuple[MismatchLog, float]:
    """Make the log and the card of a vehicle, and return them with the size of its mismatch."""
    rng = np.random.default_rng([seed, 54])
    rates = Rates.BUS if rng.uniform() < 0.5 else Rates.LOGGER
    tolerances = bool(rng.uniform() < 1.0 / 3.0)
    size = 0.0 if plan.effect is None else find_size(seed, plan.effect)
    recorded = record_vehicle(seed, plan.effect, size, rates, tolerances=tolerances)
    if plan.unlisted is not None:
        size = UNLISTED[plan.unlisted].std * float(abs(rng.standard_normal()))
        recorded = add_unlisted(recorded, plan.unlisted, size)
    card = write_card(seed, recorded.scenario, factor=plan.factor, tolerances=tolerances)
    return read_back(recorded, card), size


def _list_ratios(recorded: DynoRun) -> dict[str, float]:
    """List the true ratios and the final drive by id."""
    scenario = recorded.scenario
    i_in = scenario.model.i_in
    ratios = {f"ratio_{one.name}": scenario.get_ratio(one.element) / i_in for one in scenario.gears}
    return {**ratios, "i_f": scenario.model.i_f}


def judge_products(found: Identification, recorded: DynoRun) -> dict[str, float]:
    """Return the errors of the identified products of friction and gain over their deviations."""
    truth = {}
    for name, curve in found.friction.items():
        gain = recorded.scenario.get_element(name).gain
        truth[f"{MU_GAIN}{name}"] = gain * float(
            recorded.truth.friction[name].evaluate(np.array([curve.middle_slip]))[0]
        )
    return judge_values(found, truth)[Verdict.IDENTIFIED]


def judge_friction(found: Identification, made: MismatchLog) -> dict[str, float]:
    """Return the errors of points of the identified friction curves over their deviations.

    The truth is that for the gain on the card, unless the card states its standard deviation: the
    log determines the product alone.
    """
    errors = {}
    for name, curve in found.friction.items():
        if curve.verdict is not Verdict.IDENTIFIED:
            continue
        gain = made.recorded.scenario.get_element(name).gain
        card = made.card.elements[name].gain
        scale = 1.0 if card.std > 0.0 else gain / card.value
        for place in MU_PLACES:
            slip = float(curve.slip[0] + place * (curve.slip[-1] - curve.slip[0]))
            mu, low, high = (
                float(np.interp(slip, curve.slip, one))
                for one in (curve.mu, curve.mu_lo, curve.mu_hi)
            )
            truth = scale * float(made.recorded.truth.friction[name].evaluate(np.array([slip]))[0])
            half = high - mu if truth > mu else mu - low
            if not half > 0.0:
                continue
            errors[f"{name} at {100.0 * place:.0f} %"] = Z95 * (mu - truth) / half
    return errors


def run_study(seeds: Iterable[int], rows: Path | None, workers: int | None) -> list[RoughLog]:
    """Study the vehicles of `seeds` that the file of outcomes lacks, and append each result."""
    wanted = list(seeds)
    done = {one["seed"]: RoughLog(**one) for one in read_rows(rows)}
    with ProcessPoolExecutor(workers) as pool:
        jobs = {pool.submit(study_vehicle, seed): seed for seed in wanted if seed not in done}
        for job in as_completed(jobs):
            error = job.exception()
            one = job.result() if error is None else _record_crash(jobs[job], error)
            done[one.seed] = one
            append_row(rows, asdict(one))
            print(_format_log(one), file=sys.stderr, flush=True)
    return [done[seed] for seed in wanted]


def _record_crash(seed: int, error: BaseException) -> RoughLog:
    """Record an error that the package should have turned into one of its own."""
    plan, text = plan_vehicle(seed), f"crash: {error!r}"
    return RoughLog(seed, plan.group, plan.mismatch, 0.0, "crash", STANDARD_VALUES, failure=text)


def list_tables(logs: Sequence[RoughLog]) -> dict[str, list[dict[str, Any]]]:
    """List the raw results of logs: one row for each log, and one for each of its values."""
    rows = [
        {
            "seed": one.seed,
            "kind": one.group,
            "detail": one.mismatch,
            "status": one.status,
            "possible": one.possible,
            "failure": one.failure,
        }
        for one in logs
    ]
    values = [
        {"seed": one.seed, "kind": one.group, "name": name, "sort": sort, "apart": apart}
        for one in logs
        for sort, found in one.sorts.items()
        for name, apart in found.items()
    ]
    return {"logs": rows, "values": values}


def _format_log(one: RoughLog) -> str:
    outside = {name: round(z, 1) for name, z in one.identified.items() if abs(z) > Z95}
    return (
        f"{one.seed} {one.group} {one.mismatch} {one.size:.3g}: {one.status}, "
        f"{len(one.identified)} of {one.possible} identified {outside} {one.failure[:80]} "
        f"({one.seconds:.0f} s)"
    )


def main() -> None:
    """Run the study and print its summary."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=200, help="made vehicles")
    parser.add_argument("--first", type=int, default=0, help="first seed")
    parser.add_argument("--workers", type=int, help="processes; default one for each core")
    add_options(parser)
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.logs)
    logs = run_study(seeds, given.rows, given.workers)
    command = f"benchmarks.estimation.rough --logs {given.logs} --first {given.first}"
    finish_study("rough", command, seeds, list_tables(logs), given)


if __name__ == "__main__":
    main()
