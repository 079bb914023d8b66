# SPDX-License-Identifier: MIT
"""Coverage of intervals and naming of causes on vehicles that depart from the model."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.estimation.mismatch_log import MismatchLog, Rates, make_mismatch_log
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.effects.drum_inertia import REFERENCE_TORQUE
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.estimation.result.estimate import Z95, Verdict
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.effects import EffectId, EffectPrior

FAR = 4.0
"""Error in standard deviations from which a value is called far off."""
MODE_HZ = (28.0, 110.0)
"""Range of the frequency of an input-shaft mode [Hz]."""
EVIDENCE = 5.0
"""Log evidence from which a cause counts as named."""


@dataclass(frozen=True)
class StudyLog:
    """Result of one log: errors over total standard deviations by id, of identified and of weak
    values; the causes named with most evidence, and their evidence."""

    seed: int
    effect: str
    size: float
    identified: dict[str, float]
    weak: dict[str, float]
    named: tuple[str, ...]
    evidence: float
    certain: bool
    failure: str = ""


def draw_size(seed: int, effect: EffectId, factor: float) -> float:
    """Draw the size of an effect from its prior, times `factor`; of a mode its frequency [Hz]."""
    rng = np.random.default_rng([seed, 36])
    if effect is EffectId.INPUT_SHAFT_MODE:
        return float(np.exp(rng.uniform(*np.log(MODE_HZ))))
    size = factor * EFFECTS[effect].std
    return size if EFFECTS[effect].random else size * float(abs(rng.standard_normal()))


def make_log(seed: int, effect: EffectId | None, factor: float) -> tuple[MismatchLog, float]:
    """Make the log of one vehicle and its effect, and return it with the size of the effect.

    Every second log is from a bus, every third card states tolerances.
    """
    rates = Rates.BUS if seed % 2 else Rates.LOGGER
    size = 0.0 if effect is None else draw_size(seed, effect, factor)
    if effect is EffectId.DRUM_INERTIA:
        torque = make_mismatch_log(seed, None, 0.0, rates).recorded.scenario.engine_torque
        size *= max(abs(level) for _, level in torque.knots) / REFERENCE_TORQUE
    return make_mismatch_log(seed, effect, size, rates, tolerances=seed % 3 == 0), size


def study_log(
    seed: int, effect: EffectId | None, factor: float = 1.0, *, withheld: bool = False
) -> StudyLog:
    """Identify the log of one vehicle and hold the result against its truth.

    A `withheld` effect is switched off on the card: a cause that the table does not list.
    """
    name = "" if effect is None else effect.value
    try:
        made, size = make_log(seed, effect, factor)
        card = made.card
        if withheld and effect is not None:
            card = replace(card, effects={**card.effects, effect: EffectPrior(0.0)})
        found = identify(made.log, card, detect_shifts(made.log, card))
    except DrivetwinError as error:
        return StudyLog(seed, name, 0.0, {}, {}, (), 0.0, False, error.what)
    truth = dict(made.recorded.truth.parameters)
    if effect is EffectId.TORQUE_LAG:  # the delay of a torque that acts late is the mean one
        truth["te_delay"] -= size
    return judge(seed, name, size, found, truth)


def judge(
    seed: int, effect: str, size: float, found: Identification, truth: dict[str, float]
) -> StudyLog:
    """Hold the estimates of an identification against the `truth` by id."""
    values: dict[Verdict, dict[str, float]] = {Verdict.IDENTIFIED: {}, Verdict.WEAK: {}}
    for one in found.estimates.values():
        if one.verdict in values and one.value is not None and one.std_total and one.id in truth:
            values[one.verdict][one.id] = (one.value - truth[one.id]) / one.std_total
    cause = found.evidence.cause
    named: tuple[str, ...] = ()
    if cause is not None:
        named = tuple(str(one.effect) for one in (cause.group, *cause.equivalent))
    return StudyLog(
        seed,
        effect,
        size,
        values[Verdict.IDENTIFIED],
        values[Verdict.WEAK],
        named,
        0.0 if cause is None else cause.evidence,
        cause is not None and cause.is_certain,
        found.evidence.gave_up,
    )


def run_study(
    seeds: Iterable[int],
    effects: Sequence[EffectId | None],
    factor: float,
    *,
    withheld: bool = False,
    processes: int | None = None,
) -> list[StudyLog]:
    """Study one log for each seed; the effects take turns. Print each log as it is done."""
    study = partial(study_log, factor=factor, withheld=withheld)
    logs = []
    with ProcessPoolExecutor(processes) as pool:
        jobs = [pool.submit(study, one, effects[k % len(effects)]) for k, one in enumerate(seeds)]
        for job in jobs:
            logs.append(job.result())
            print(_format_log(logs[-1]), file=sys.stderr, flush=True)
    return logs


def _format_log(one: StudyLog) -> str:
    """Format the row of one log: what its values are called, and the errors of those outside."""
    outside = {
        key: round(error, 1)
        for key, error in {**one.identified, **one.weak}.items()
        if abs(error) > Z95
    }
    counts = f"{len(one.identified):2d} identified, {len(one.weak):2d} weak"
    cause = f"{', '.join(one.named)} {one.evidence:.1f}" if one.named else ""
    return f"{one.seed} {one.effect} {one.size:.3g}: {counts} {outside} {cause} {one.failure[:60]}"


def summarise(logs: Sequence[StudyLog]) -> list[str]:
    """Summarise the coverage by effect, of all departing and of all other logs, and the naming."""
    groups = {
        name: [one for one in logs if one.effect == name]
        for name in dict.fromkeys(one.effect for one in logs)
    }
    lines = [_format_row(name or "none", group) for name, group in groups.items()]
    departing = [one for one in logs if one.effect]
    lines.append(_format_row("all departing", departing))
    evident = [one for one in departing if one.evidence > EVIDENCE]
    right = sum(one.effect in one.named for one in evident)
    obeying = groups.get("", [])
    false = sum(one.evidence > EVIDENCE for one in obeying)
    lines.append(f"right cause {right} of {len(evident)}, false alarms {false} of {len(obeying)}")
    return lines


def _format_row(name: str, logs: Sequence[StudyLog]) -> str:
    identified = [z for one in logs for z in one.identified.values()]
    weak = [z for one in logs for z in one.weak.values()]
    inside = sum(abs(z) < Z95 for z in identified)
    far = sum(abs(z) > FAR for z in identified)
    share = 100.0 * inside / max(len(identified), 1)
    failed = sum(bool(one.failure) for one in logs)
    return (
        f"{name:22s} {len(logs):3d} logs ({failed} failed), identified {inside:4d} of "
        f"{len(identified):4d} inside ({share:.0f} %), {far} far; weak "
        f"{sum(abs(z) < Z95 for z in weak)} of {len(weak)}"
    )


def main() -> None:
    """Run the study and print its summary."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=200, help="departing logs")
    parser.add_argument("--obeying", type=int, default=60, help="logs that obey the model")
    parser.add_argument("--first", type=int, default=1000, help="first seed")
    parser.add_argument("--factor", type=float, default=1.0, help="factor of all sizes")
    parser.add_argument("--withheld", action="store_true", help="switch each true effect off")
    parser.add_argument("--processes", type=int, help="processes; default one for each core")
    parser.add_argument("-o", "--output", type=Path, help="write the results as JSON")
    given = parser.parse_args()
    seeds = range(given.first, given.first + given.logs)
    study = partial(
        run_study, factor=given.factor, withheld=given.withheld, processes=given.processes
    )
    logs = study(seeds, list(EFFECTS))
    seeds = range(given.first + given.logs, given.first + given.logs + given.obeying)
    logs += study(seeds, [None])
    print("\n".join(summarise(logs)))
    if given.output:
        given.output.write_text(json.dumps([asdict(one) for one in logs]), encoding="utf-8")


if __name__ == "__main__":
    main()
