# SPDX-License-Identifier: MIT
"""Results of `benchmarks.ablation`, and their table: one row for each variant."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from drivetwin.estimation.result.estimate import Z95
from tools.result_blocks.accuracy import FAR

ALL_ON = "all on"
"""Variant without anything disabled."""
TOGETHER = "+"
"""Joins the names of what is disabled together."""


@dataclass(frozen=True)
class Outcome:
    """Result of one log in one variant, errors over total standard deviations by id.

    `possible` is the number of values that could be identified, `seconds` the CPU time of the
    identification, `stages` that of its stages. `idle` lists the mechanisms that did nothing in
    the log, with all enabled.
    """

    study: str
    seed: int
    variant: str
    identified: dict[str, float]
    weak: dict[str, float]
    possible: int
    seconds: float
    failure: str = ""
    idle: Sequence[str] = ()
    stages: Mapping[str, float] = field(default_factory=dict)


Outcomes = dict[tuple[str, int, str], Outcome]
"""Results by study, seed and variant."""


def read_outcomes(path: Path) -> Outcomes:
    """Read the results of an output file; a line that was cut off is left out."""
    found: Outcomes = {}
    for line in path.read_text(encoding="utf-8").splitlines() if path.exists() else ():
        try:
            one = Outcome(**json.loads(line))
        except json.JSONDecodeError:
            continue
        found[one.study, one.seed, one.variant] = one
    return found


def find_outcome(
    outcomes: Mapping[tuple[str, int, str], Outcome], study: str, seed: int, variant: str
) -> Outcome | None:
    """Find the result of a variant; that of all enabled where its mechanisms did nothing."""
    base = outcomes.get((study, seed, ALL_ON))
    if base is not None and set(variant.split(TOGETHER)) <= set(base.idle):
        return base
    return outcomes.get((study, seed, variant))


Pair = tuple[Outcome, Outcome]
"""Result of a log with all enabled, and that of a variant."""


def format_table(outcomes: Outcomes) -> list[str]:
    """Format one row for each variant, by the logs that have both results."""
    bases = [one for one in outcomes.values() if one.variant == ALL_ON]
    names = {one.variant for one in outcomes.values()} | {k for one in bases for k in one.idle}
    lines = [
        "| without | logs | run | inside | kept | far | new far | now outside | now inside "
        "| lost | gained | CPU [s] | CPU |",
        "|" + "---|" * 13,
    ]
    for name in sorted(names, key=lambda one: (one != ALL_ON, one)):
        found = [(one, find_outcome(outcomes, one.study, one.seed, name)) for one in bases]
        pairs = [(base, other) for base, other in found if other is not None]
        if pairs:
            lines.append(_format_row(name, pairs))
    return lines


STAGES: Mapping[str, tuple[str, ...]] = {
    "load terms": ("model selection/restriction",),
    "other minima": ("model selection/minima",),
    "plants": ("likelihood/plant",),
}
"""Stages in which a mechanism acts."""


def format_stages(outcomes: Outcomes) -> str:
    """Format the share of the CPU time of each mechanism in the runs with all enabled."""
    bases = [one for one in outcomes.values() if one.variant == ALL_ON and one.stages]
    whole = sum(one.seconds for one in bases)
    shares = []
    for name, keys in STAGES.items() if bases else ():
        own = sum(one.stages.get(key, 0.0) for one in bases for key in keys)
        shares.append(f"{name} {100.0 * own / whole:.1f} %")
    return f"CPU time by stage in {len(bases)} logs: {', '.join(shares)}"


def _format_row(name: str, pairs: Sequence[Pair]) -> str:
    others = [other for _, other in pairs]
    identified = [z for one in others for z in one.identified.values()]
    inside = sum(abs(z) < Z95 for z in identified)
    possible = sum(one.possible for one in others)
    common = [
        (base.identified[name], z)
        for base, other in pairs
        for name, z in other.identified.items()
        if name in base.identified
    ]
    cells = [
        "nothing" if name == ALL_ON else name.replace("_", " "),
        len(pairs),
        sum(other is not base for base, other in pairs),
        f"{inside} of {len(identified)} = {100.0 * inside / max(len(identified), 1):.1f} %",
        f"{len(identified)} of {possible} = {100.0 * len(identified) / possible:.1f} %",
        sum(abs(z) > FAR for z in identified),
        sum(_count_new_far(base, other) for base, other in pairs),
        sum(abs(old) < Z95 <= abs(new) for old, new in common),
        sum(abs(new) < Z95 <= abs(old) for old, new in common),
        sum(len(base.identified.keys() - other.identified.keys()) for base, other in pairs),
        sum(len(other.identified.keys() - base.identified.keys()) for base, other in pairs),
        f"{sum(one.seconds for one in others) / len(pairs):.1f}",
        f"{100.0 * _compute_share(pairs):.0f} %",
    ]
    return "| " + " | ".join(map(str, cells)) + " |"


def _count_new_far(base: Outcome, other: Outcome) -> int:
    """Count the identified values that are far off in the variant alone."""
    far = {name for name, z in base.identified.items() if abs(z) > FAR}
    return sum(abs(z) > FAR and name not in far for name, z in other.identified.items())


def _compute_share(pairs: Sequence[Pair]) -> float:
    """Compute the CPU time of a variant over that of all enabled."""
    return sum(other.seconds for _, other in pairs) / sum(base.seconds for base, _ in pairs)
