# SPDX-License-Identifier: MIT
"""Worth of each mechanism that chooses a model, and of each group of effects.

A log of `benchmarks.estimation.validity` or `.rough` is identified with all of them, and again
without each. The output file has one line of JSON for a log and a variant; a further call continues
it. A variant that cannot change a log, by the stages that ran in it, is not run.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from functools import lru_cache
from itertools import product
from pathlib import Path

from benchmarks.ablation_table import (
    ALL_ON,
    Outcome,
    find_outcome,
    format_stages,
    format_table,
    read_outcomes,
)
from benchmarks.estimation.rough import make_vehicle, plan_vehicle
from benchmarks.estimation.validity import (
    correct_delay,
    count_possible,
    identify_validated,
    judge_values,
    make_log,
    withhold,
)
from benchmarks.stage_clock import record_stages
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.direct.load_balance import AERO
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.estimation.likelihood.mechanism import Mechanism, disable
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.findings import Code
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.effects import EffectId

STUDIES = ("validity", "rough")
PARTS = ("preparation", "estimation")
"""Stages of an identification whose CPU time counts."""
IDLE = 0.02
"""CPU time [s] of a stage in which no fit was run."""
MODES = frozenset({Mechanism.SAMPLING_MODES})
"""Mechanisms that have no object while all signals are taken as read."""
GROUPS: Mapping[str, tuple[EffectId, ...]] = {
    "effects: wheel load": (EffectId.SLOW_LOAD, EffectId.AERO_LOAD, EffectId.BRAKE_DRAG),
    "effects: gear losses": (EffectId.EFFICIENCY_BY_GEAR, EffectId.INPUT_DRAG),
    "effects: clutch": (
        *(EffectId.DRUM_INERTIA, EffectId.FRICTION_SHAPE),
        *(EffectId.FRICTION_PRESSURE, EffectId.FRICTION_HEAT),
    ),
    "effects: torque sensor": (
        *(EffectId.OUTPUT_TORQUE_OFFSET, EffectId.OUTPUT_TORQUE_DRIFT),
        *(EffectId.OUTPUT_TORQUE_DELAY, EffectId.OUTPUT_TORQUE_CURVE),
        EffectId.OUTPUT_TORQUE_FILTER,
    ),
    "effects: speed sensors": (EffectId.SPEED_RUN_OUT,),
    "effects: inputs": (EffectId.PRESSURE_DELAY, EffectId.TORQUE_LAG, EffectId.TORQUE_MAP),
    "effects: shaft, tyre": (
        *(EffectId.INPUT_SHAFT_MODE, EffectId.TYRE_SLIP, EffectId.BACKLASH),
        EffectId.PROGRESSIVE_SHAFT,
    ),
}
"""Effects by the part on which they act."""
VARIANTS = (*Mechanism, *GROUPS)
"""Single mechanisms and groups; names joined by `+` are disabled together."""


@dataclass(frozen=True, eq=False)
class MadeLog:
    """A log with its card, its truth by id, and the number of values that could be identified."""

    log: ShiftLog
    card: VehicleCard
    truth: Mapping[str, float]
    possible: int


@lru_cache(maxsize=1)
def make_case(study: str, seed: int) -> MadeLog:
    """Make the log of a seed in a study; effects take turns by the seed in `validity`."""
    if study == "validity":
        effect: EffectId | None = list(EFFECTS)[seed % len(EFFECTS)]
        made, size = make_log(seed, effect, 1.0)
        card, possible = made.card, count_possible(made)
    else:
        plan = plan_vehicle(seed)
        made, size = make_vehicle(seed, plan)
        effect, possible = plan.effect, len(made.recorded.truth.parameters)
        card = withhold(made.card, effect) if plan.withheld and effect else made.card
    truth = correct_delay(made.recorded.truth.parameters, effect, size)
    return MadeLog(made.log, card, truth, possible)


@contextmanager
def disable_variant(variant: str) -> Iterator[tuple[EffectId, ...]]:
    """Disable mechanisms inside the block; yield the effects that the card has to switch off.

    Nothing admits an effect that is missing, although the log shows it.
    """
    names = [] if variant == ALL_ON else variant.split("+")
    effects = [effect for name in names for effect in GROUPS.get(name, ())]
    off = {Mechanism(name) for name in names if name not in GROUPS}
    off |= MODES if Mechanism.SAMPLING_MODES in off else set()
    off |= {Mechanism.ADMISSION} if effects else set()
    with disable(off):
        yield tuple(effects)


def run_variant(study: str, seed: int, variant: str) -> Outcome:
    """Identify the log of a seed without the mechanisms and groups of a variant."""
    made = make_case(study, seed)
    found, failure = None, ""
    with disable_variant(variant) as effects, record_stages() as clock:
        try:
            found = identify_validated(made.log, withhold(made.card, *effects))
        except DrivetwinError as error:
            failure = " ".join(error.what.split())
    stages = {f"{one}/{stage}": seconds for (one, stage), seconds in clock.seconds.items()}
    values: dict[Verdict, dict[str, float]] = {Verdict.IDENTIFIED: {}, Verdict.WEAK: {}}
    if found is not None:
        values, failure = judge_values(found, made.truth), found.evidence.gave_up
    return Outcome(
        study,
        seed,
        variant,
        values[Verdict.IDENTIFIED],
        values[Verdict.WEAK],
        made.possible,
        sum(stages.get(f"likelihood identification/{one}", 0.0) for one in PARTS),
        failure,
        find_idle(found, stages) if found is not None and variant == ALL_ON else (),
        {name: one for name, one in stages.items() if one > IDLE},
    )


def find_idle(found: Identification, stages: Mapping[str, float]) -> list[str]:
    """Find the mechanisms that did nothing in a log, by the CPU time [s] of its stages.

    Those that tried a fit are not among them: a fit that is not chosen may widen intervals.
    """
    fit = found.evidence.likelihood
    grows = fit is not None and AERO in fit.point.names
    is_selected = "model selection/other outputs" in stages
    is_restricted = "model selection/restriction" in stages and not grows
    is_idle = {
        Mechanism.LOAD_GROWTH: is_selected and not grows,
        Mechanism.LOAD_TERMS: len(found.shifts) == 1 and not is_restricted,
        Mechanism.BACKLASH_FIRST: is_selected,
        Mechanism.ADMISSION: all(one.code is not Code.EFFECT_EXCLUDED for one in found.findings),
        Mechanism.PLANTS: "plant/first refit" not in stages,
    }
    return [str(name) for name, idle in is_idle.items() if idle]


def run_study(
    seeds: Sequence[int], studies: Sequence[str], variants: Sequence[str], output: Path
) -> None:
    """Run what the output file lacks, log by log, and append each result to it."""
    done = read_outcomes(output)
    text = output.read_text(encoding="utf-8") if output.exists() else ""
    with output.open("a", encoding="utf-8") as file:
        file.write("\n" if text and not text.endswith("\n") else "")
        for seed, study in product(seeds, studies):
            for variant in (ALL_ON, *variants):
                if find_outcome(done, study, seed, variant) is not None:
                    continue
                one = run_variant(study, seed, variant)
                done[study, seed, variant] = one
                file.write(json.dumps(asdict(one)) + "\n")
                file.flush()


def main() -> None:
    """Run the study, unless only its table is asked for, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--first", type=int, default=3000, help="first seed")
    parser.add_argument("--logs", type=int, default=60, help="logs of each study; 0: table only")
    parser.add_argument("--study", nargs="+", choices=STUDIES, default=STUDIES)
    parser.add_argument(
        "--without", nargs="+", default=VARIANTS,
        help="variants; names joined by + are disabled together; default: each by itself",
    )  # fmt: skip
    parser.add_argument("-o", "--output", type=Path, default=Path("out/ablation.jsonl"))
    given = parser.parse_args()
    given.output.parent.mkdir(parents=True, exist_ok=True)
    seeds = range(given.first, given.first + given.logs)
    run_study(seeds, given.study, given.without, given.output)
    outcomes = read_outcomes(given.output)
    print("\n".join([*format_table(outcomes), "", format_stages(outcomes)]))


if __name__ == "__main__":
    main()
