# SPDX-License-Identifier: MIT
"""Coverage of intervals and naming of causes on vehicles that depart from the model."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, replace
from functools import partial
from itertools import cycle
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.estimation.mismatch_log import MismatchLog, Rates, make_mismatch_log
from benchmarks.estimation.vehicles import draw_vehicle
from benchmarks.raw_results import add_options, finish_study
from benchmarks.rows import append_row, read_rows
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.effects.expansion import expand_effects
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.estimation.likelihood.effects.torques import REFERENCE_TORQUE
from drivetwin.estimation.result.cause import LEAD
from drivetwin.estimation.result.estimate import Z95, Verdict
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.twin.build import build_twin
from drivetwin.validation.simulate_log import attach_validation
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.effects import EffectId, EffectPrior
from tools.result_blocks.accuracy import TWO

MODE_HZ = (28.0, 110.0)
"""Range of the frequency of an input-shaft mode [Hz]."""
MOVED = 2.0
"""Move of a parameter by an effect, in standard deviations, from which its cause must be found."""
VISIBLE = LEAD + float(np.log(len(EFFECTS)))
"""Log evidence below which no cause is named."""
LEAST_POSSIBLE = 11
"""Values that could be identified of a vehicle without a log: those of the truth less P0."""
PHYSICAL = ("eta", "J_e", "J_out", "te_delay", "J_vehicle", "Tv_over_if", "k_o", "c_o")
"""Unknowns of a fit whose moves count beside those of P0."""
CERTAIN_CHI2 = 1.2
"""Q per sample above which a fit does not explain the log, so that no cause may be certain."""


@dataclass(frozen=True)
class StudyLog:
    """Result of one log: errors over total standard deviations by id, of identified and of weak
    values; the causes named with most evidence, and their evidence.

    `possible` is the number of values that could be identified: those of the truth without the P0
    that the card states exactly. `moved` and `own_evidence` are those of `Move`; None where they
    were not computed. `chi2` is that of the fit, None without one.
    """

    seed: int
    effect: str
    size: float
    identified: dict[str, float]
    weak: dict[str, float]
    named: tuple[str, ...]
    evidence: float
    certain: bool
    failure: str = ""
    possible: int = 0
    moved: float | None = None
    own_evidence: float | None = None
    chi2: float | None = None
    status: str = ""

    @property
    def kind(self) -> str:
        """Effect of the vehicle."""
        return TWO if "+" in self.effect else self.effect or "none"


@dataclass(frozen=True)
class Move:
    """Consequences of an effect for a fit without effects.

    `values` is the largest move of an unknown over its standard deviation from noise, `evidence`
    the log evidence of the effect alone, as a method has it that knows the cause; 0 for an effect
    without columns. Both are infinite where the fit has a part of the plant or fails.
    """

    values: float
    evidence: float


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
    size = 0.0 if effect is None else find_size(seed, effect, factor)
    return make_sized_log(seed, effect, size), size


def make_sized_log(seed: int, effect: EffectId | None, size: float) -> MismatchLog:
    """Make the log of `make_log` with an effect of a size; 0 leaves all but the effect as it is."""
    rates = Rates.BUS if seed % 2 else Rates.LOGGER
    return make_mismatch_log(seed, effect, size, rates, tolerances=seed % 3 == 0)


def find_size(seed: int, effect: EffectId, factor: float = 1.0) -> float:
    """Return the size of an effect of the vehicle of `seed`; a drum grows with the vehicle."""
    size = draw_size(seed, effect, factor)
    if effect is EffectId.DRUM_INERTIA:
        knots = draw_vehicle(seed).scenario.engine_torque.knots
        size *= max(abs(level) for _, level in knots) / REFERENCE_TORQUE
    return size


def withhold(card: VehicleCard, *effects: EffectId) -> VehicleCard:
    """Switch effects off on the card."""
    return replace(card, effects={**card.effects, **dict.fromkeys(effects, EffectPrior(0.0))})


def identify_validated(log: ShiftLog, card: VehicleCard) -> Identification:
    """Identify and validate a log as `drivetwin identify` does."""
    found = identify(log, card, detect_shifts(log, card))
    return attach_validation(found, build_twin(found, card), log)


def correct_delay(
    truth: Mapping[str, float], effect: EffectId | None, size: float
) -> dict[str, float]:
    """Return the truth with the mean delay of an engine torque that acts late, by the effect."""
    lag = size if effect is EffectId.TORQUE_LAG else 0.0
    return {**truth, "te_delay": truth["te_delay"] - lag}


def study_log(
    seed: int, effect: EffectId | None, factor: float = 1.0, *, withheld: bool = False
) -> StudyLog:
    """Identify the log of one vehicle and hold the result against its truth.

    A `withheld` effect is switched off on the card: a cause that the table does not list.
    """
    name = "" if effect is None else effect.value
    possible = 0
    try:
        made, size = make_log(seed, effect, factor)
        possible = count_possible(made)
        card = withhold(made.card, effect) if withheld and effect is not None else made.card
        found = identify_validated(made.log, card)
    except DrivetwinError as error:
        return StudyLog(
            seed, name, 0.0, {}, {}, (), 0.0, False, error.what, possible or LEAST_POSSIBLE
        )
    truth = correct_delay(made.recorded.truth.parameters, effect, size)
    judged = replace(judge(seed, name, size, found, truth), possible=possible)
    move = None if effect is None else measure_move(seed, effect, found, card)
    if move is None:
        return judged
    return replace(judged, moved=move.values, own_evidence=move.evidence)


def study_pair(seed: int) -> StudyLog:
    """Identify the log of a vehicle with two effects, drawn by its seed."""
    rng = np.random.default_rng([seed, 37])
    listed = list(EFFECTS)
    first, second = (listed[k] for k in rng.choice(len(listed), 2, replace=False))
    size, other = find_size(seed, first), find_size(seed, second)
    name = f"{first}+{second}"
    rates = Rates.BUS if seed % 2 else Rates.LOGGER
    try:
        made = make_mismatch_log(
            seed, first, size, rates, tolerances=seed % 3 == 0, beside={second: other}
        )
        found = identify_validated(made.log, made.card)
    except DrivetwinError as error:
        none: dict[str, float] = {}
        return StudyLog(
            seed, name, size, none, none, (), 0.0, False, error.what, possible=LEAST_POSSIBLE
        )
    truth = made.recorded.truth.parameters
    for effect, one in ((first, size), (second, other)):
        truth = correct_delay(truth, effect, one)
    return replace(judge(seed, name, size, found, truth), possible=count_possible(made))


def count_possible(made: MismatchLog) -> int:
    """Count the values of the truth that the card does not state exactly."""
    known = sum(one.P0.std == 0.0 for one in made.card.elements.values())
    return len(made.recorded.truth.parameters) - known


def measure_move(
    seed: int, effect: EffectId, found: Identification, card: VehicleCard
) -> Move | None:
    """Measure what the effect of a log does to a fit without effects; None without such a fit.

    The same vehicle without the effect has the same noise, so that the difference of both fits is
    the effect alone.
    """
    try:
        plain = make_sized_log(seed, effect, 0.0)
        bare = withhold(plain.card, *EFFECTS)
        other = identify(plain.log, bare, detect_shifts(plain.log, bare)).evidence.likelihood
    except DrivetwinError:
        return None
    fit = found.evidence.likelihood
    if other is None or other.plant is not None:
        return None
    if fit is None or fit.plant is not None:
        return Move(np.inf, np.inf)
    values = dict(zip(fit.point.names, fit.point.values.tolist(), strict=True))
    std = np.sqrt(np.diag(other.noise_covariance))
    rows = zip(other.point.names, other.point.values.tolist(), std.tolist(), strict=True)
    moves = [
        abs(values[name] - value) / spread
        for name, value, spread in rows
        if name in values and (name in PHYSICAL or name.endswith(".P0"))
    ]
    expansion = expand_effects(fit, EffectPriors({}, card.sensors))
    groups = {} if expansion is None else expansion.evidence
    nats = [one.nats for group, one in groups.items() if group.effect is effect]
    return Move(max(moves, default=0.0), max(nats, default=0.0))


def judge(
    seed: int, effect: str, size: float, found: Identification, truth: Mapping[str, float]
) -> StudyLog:
    """Hold the estimates of an identification against the `truth` by id."""
    values = judge_values(found, truth)
    cause, fit = found.evidence.cause, found.evidence.likelihood
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
        chi2=None if fit is None else fit.chi2,
        status=found.status.value,
    )


def judge_values(
    found: Identification, truth: Mapping[str, float]
) -> dict[Verdict, dict[str, float]]:
    """Return the errors over total standard deviations by id, of identified and weak values."""
    values: dict[Verdict, dict[str, float]] = {Verdict.IDENTIFIED: {}, Verdict.WEAK: {}}
    for one in found.estimates.values():
        if one.verdict in values and one.value is not None and one.std_total and one.id in truth:
            values[one.verdict][one.id] = (one.value - truth[one.id]) / one.std_total
    return values


def run_jobs(
    jobs: Mapping[int, Callable[[], StudyLog]], rows: Path | None, processes: int | None
) -> list[StudyLog]:
    """Run the jobs whose seeds the file of outcomes lacks; print each log as it is done."""
    done = {one["seed"]: StudyLog(**one) for one in read_rows(rows)}
    with ProcessPoolExecutor(processes) as pool:
        running = [pool.submit(job) for seed, job in jobs.items() if seed not in done]
        for one in as_completed(running):
            log = one.result()
            done[log.seed] = log
            append_row(rows, asdict(log))
            print(_format_log(log), file=sys.stderr, flush=True)
    return [done[seed] for seed in jobs]


def _format_log(one: StudyLog) -> str:
    """Format the row of one log: what its values are called, and the errors of those outside."""
    outside = {
        key: round(error, 1)
        for key, error in {**one.identified, **one.weak}.items()
        if abs(error) > Z95
    }
    counts = f"{len(one.identified):2d} identified, {len(one.weak):2d} weak"
    cause = f"{', '.join(one.named)} {one.evidence:.1f}" if one.named else ""
    moved = (
        "" if one.moved is None else f"moved {one.moved:.1f}, own evidence {one.own_evidence:.1f}"
    )
    chi2 = "" if one.chi2 is None else f"chi2 {one.chi2:.2f}"
    head = f"{one.seed} {one.effect} {one.size:.3g}: {counts} {outside}"
    return f"{head} {cause} {moved} {chi2} {one.failure[:60]}"


def list_tables(logs: Sequence[StudyLog]) -> dict[str, list[dict[str, Any]]]:
    """List the raw results of logs: one row for each log, and one for each of its values."""
    return {
        "logs": [_describe_log(one) for one in logs],
        "values": [
            {"seed": one.seed, "kind": one.kind, "name": name, "sort": sort, "apart": apart}
            for one in logs
            for sort, values in (("identified", one.identified), ("weak", one.weak))
            for name, apart in values.items()
        ],
    }


def _describe_log(one: StudyLog) -> dict[str, Any]:
    moved = one.moved is not None and one.moved > MOVED
    return {
        "seed": one.seed,
        "kind": one.kind,
        "detail": f"{one.effect} {one.size:.3g}" if one.effect else "",
        "status": one.status or "no result",
        "possible": one.possible,
        "failure": one.failure,
        "evident": one.evidence > LEAD,
        "right": one.effect in one.named,
        "moved": moved,
        "visible": moved and (one.own_evidence or 0.0) > VISIBLE,
        "overconfident": one.certain and one.chi2 is not None and one.chi2 > CERTAIN_CHI2,
    }


def main() -> None:
    """Run the study and print its summary."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--logs", type=int, default=200, help="departing logs")
    parser.add_argument("--obeying", type=int, default=60, help="logs that obey the model")
    parser.add_argument("--pairs", type=int, default=0, help="logs with two effects")
    parser.add_argument("--first", type=int, default=1000, help="first seed")
    parser.add_argument("--factor", type=float, default=1.0, help="factor of all sizes")
    parser.add_argument("--withheld", action="store_true", help="switch each true effect off")
    parser.add_argument("--processes", type=int, help="processes; default one for each core")
    add_options(parser)
    given = parser.parse_args()
    study = partial(study_log, factor=given.factor, withheld=given.withheld)
    departing = range(given.first, given.first + given.logs)
    obeying = range(departing.stop, departing.stop + given.obeying)
    pairs = range(obeying.stop, obeying.stop + given.pairs)
    jobs = {
        **{
            seed: partial(study, seed, effect)
            for seed, effect in zip(departing, cycle(EFFECTS), strict=False)
        },
        **{seed: partial(study, seed, None) for seed in obeying},
        **{seed: partial(study_pair, seed) for seed in pairs},
    }
    logs = run_jobs(jobs, given.rows, given.processes)
    command = "benchmarks.estimation.validity"
    command += f" --logs {given.logs} --obeying {given.obeying} --pairs {given.pairs}"
    command += f" --first {given.first}"
    command += " --withheld" * given.withheld
    command += f" --factor {given.factor:g}" * (given.factor != 1.0)
    finish_study("validity", command, [*jobs], list_tables(logs), given)


if __name__ == "__main__":
    main()
