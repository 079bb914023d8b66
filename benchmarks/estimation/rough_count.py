# SPDX-License-Identifier: MIT
"""Counts over logs: values inside their intervals with a bootstrap, values far off, values kept."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from drivetwin.estimation.result.estimate import Z95

FAR = 4.0
"""Error in standard deviations from which a value is called far off."""
RESAMPLES = 4000
"""Number of bootstrap samples of the logs [count]."""


@dataclass(frozen=True)
class RoughLog:
    """Result of one log, errors over total standard deviations by id.

    `possible` is the number of values that could be identified, `ratios` are identified ratios and
    final drives, `mu_gain` identified products of friction and gain, `friction` the errors of
    points of the friction curves. `failure` is the message where there is no result.
    """

    seed: int
    group: str
    mismatch: str
    size: float
    status: str
    possible: int
    identified: dict[str, float] = field(default_factory=dict)
    weak: dict[str, float] = field(default_factory=dict)
    ratios: dict[str, float] = field(default_factory=dict)
    mu_gain: dict[str, float] = field(default_factory=dict)
    mu_gain_reported: int = 0
    friction: dict[str, float] = field(default_factory=dict)
    failure: str = ""
    seconds: float = 0.0


@dataclass(frozen=True)
class Share:
    """Share of values with a 95 % percentile interval by bootstrap over logs; NaN of none."""

    part: int
    whole: int
    low: float
    high: float

    def __str__(self) -> str:
        if self.whole == 0:
            return "none"
        percent = 100.0 * self.part / self.whole
        interval = f"{100.0 * self.low:.0f} to {100.0 * self.high:.0f}"
        return f"{self.part} of {self.whole} = {percent:.1f} % ({interval})"


def compute_share(parts: Sequence[int], wholes: Sequence[int], seed: int = 0) -> Share:
    """Compute the share of all values and its bootstrap over logs.

    Values of one log have common errors, so that logs are drawn and not values.

    Parameters
    ----------
    parts, wholes
        Counted values and all values of each log (n,).
    seed
        Seed of the bootstrap.
    """
    part, whole = np.asarray(parts, dtype=int), np.asarray(wholes, dtype=int)
    total = int(whole.sum())
    if total == 0:
        return Share(0, 0, float("nan"), float("nan"))
    drawn = np.random.default_rng(seed).integers(part.size, size=(RESAMPLES, part.size))
    sums = whole[drawn].sum(axis=1)
    shares = part[drawn].sum(axis=1)[sums > 0] / sums[sums > 0]
    low, high = np.percentile(shares, (2.5, 97.5))
    return Share(int(part.sum()), total, float(low), float(high))


def count_inside(groups: Sequence[dict[str, float]]) -> Share:
    """Count the errors within a 95 % interval; one dictionary for each log."""
    parts = [sum(abs(z) < Z95 for z in one.values()) for one in groups]
    return compute_share(parts, [len(one) for one in groups])


def compute_kept(identified: Sequence[int], possible: Sequence[int]) -> Share:
    """Compute the share of values kept; a log without result has identified 0."""
    return compute_share(identified, possible)


def list_far(logs: Sequence[RoughLog]) -> list[str]:
    """List seed, parameter and error of the identified values beyond `FAR`, one line for a log."""
    lines = []
    for one in logs:
        far = {name: z for name, z in one.identified.items() if abs(z) > FAR}
        if far:
            values = ", ".join(f"{name} {z:+.1f}" for name, z in far.items())
            lines.append(f"{one.seed} ({one.mismatch or 'none'}): {values}")
    return lines


def summarise(logs: Sequence[RoughLog]) -> list[str]:
    """Summarise each group in a few lines."""
    lines = []
    for name in dict.fromkeys(sorted(one.group for one in logs)):
        group = [one for one in logs if one.group == name]
        lines += ["", *_summarise_group(name, group)]
    return lines[1:]


def _summarise_group(name: str, logs: Sequence[RoughLog]) -> list[str]:
    far = list_far(logs)
    kept = compute_kept([len(one.identified) for one in logs], [one.possible for one in logs])
    reported = sum(one.mu_gain_reported for one in logs)
    mu_gain = count_inside([one.mu_gain for one in logs]) if reported else "not reported"
    missing = Counter(one.failure for one in logs if one.failure)
    return [
        f"{name}: {len(logs)} logs",
        f"  inside            {count_inside([one.identified for one in logs])}",
        f"  logs beyond {FAR:g}     {len(far)}",
        *(f"    {line}" for line in far),
        f"  kept              {kept}",
        f"  weak inside       {count_inside([one.weak for one in logs])}",
        f"  friction points   {count_inside([one.friction for one in logs])}",
        f"  mu_gain inside    {mu_gain}",
        f"  ratios inside     {count_inside([one.ratios for one in logs])}",
        f"  statuses          {_format_counts(Counter(one.status for one in logs))}",
        *(f"    {count} x {text[:100]}" for text, count in missing.most_common()),
    ]


def _format_counts(counts: Counter[str]) -> str:
    return ", ".join(f"{name} {count}" for name, count in counts.most_common())
