# SPDX-License-Identifier: MIT
"""The text of docs/accuracy.md."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.estimation.mismatch import SHOWN, Shift
from benchmarks.estimation.starts import OFF, Outcome
from benchmarks.estimation.study import Sample, Study

HEAD = """# Accuracy of the estimators

Written by `make accuracy` from noise realisations of the virtual dynamometer, others in every case.
The bound is that of Cramér and Rao: the Fisher information at the truth, with the noise of
outputs and inputs and the priors of the card in it, computed by disturbing every input sample of
the simulation; nothing of it is taken from the fits. Design values that the card knows only
roughly are drawn about the truth. Coverage is that of the stated 95 % intervals from noise.
From n realisations RMSE/bound has a standard error of 1/√(2n), coverage one of √(475/n) %.
"""

STARTS = """## From bad start values

The linear method is off; every start value is drawn evenly within ± {off:.0f} % of the truth, those
of P0 are the card's. *right* means that every parameter lies inside the 95 % interval of the fit
that starts at the truth; a *refused* try says that it failed.

| tries | right | refused | wrong |
|---|---|---|---|
| {tries} | {right} | {refused} | {wrong} |
"""

MISMATCH = """## What faults do that nobody states

Shift of the mean of {count} realisations against the same seeds without the fault, in %; the age of
the engine torque in ms. `chi2` is Q per sample without and with the fault: it does not warn. Jo′
± 10 %, P0 known.
"""


@dataclass(frozen=True)
class Page:
    """What has been computed so far: studies with a word on each, bad starts, faults."""

    studies: tuple[tuple[Study, str], ...] = ()
    outcomes: Counter[Outcome] | None = None
    shifts: tuple[Shift, ...] = ()
    faulty: int = 0

    def with_study(self, study: Study, text: str) -> Page:
        """The page with one more case."""
        return replace(self, studies=(*self.studies, (study, text)))

    def with_outcomes(self, outcomes: Counter[Outcome]) -> Page:
        """The page with the tries of bad starts."""
        return replace(self, outcomes=outcomes)

    def with_shift(self, shift: Shift, count: int) -> Page:
        """The page with one more fault, from `count` realisations."""
        return replace(self, shifts=(*self.shifts, shift), faulty=count)


def text_of(made: Page) -> str:
    """The whole page."""
    parts = [HEAD, *(_section(study, text) for study, text in made.studies)]
    if made.outcomes is not None:
        parts.append(_starts(made.outcomes))
    if made.shifts:
        parts += [MISMATCH.format(count=made.faulty), *_faults(made.shifts), ""]
    return "\n".join(parts)


def _starts(outcomes: Counter[Outcome]) -> str:
    return STARTS.format(
        off=100 * OFF,
        tries=outcomes.total(),
        right=outcomes[Outcome.RIGHT],
        refused=outcomes[Outcome.REFUSED],
        wrong=outcomes[Outcome.WRONG],
    )


def _faults(shifts: tuple[Shift, ...]) -> list[str]:
    head = ("fault", *SHOWN, "te_delay", "chi2")
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    for one in shifts:
        if one.percent is None:
            lines.append(
                f"| {one.fault.text} | refused: no plausible minimum |" + " |" * len(SHOWN)
            )
            continue
        cells = [f"{one.percent[name]:+.2f}" for name in SHOWN]
        chi2 = f"{one.chi2[0]:.3f} → {one.chi2[1]:.3f}"
        lines.append(f"| {' | '.join([one.fault.text, *cells, f'{one.delay:+.2f}', chi2])} |")
    return lines


def _section(study: Study, text: str) -> str:
    lines = [f"## {study.name}: {text}", ""]
    head = ("parameter", "bound", "method", "bias", "std", "RMSE/bound", "coverage")
    lines += [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    for method, by_name in study.samples.items():
        for name, samples in by_name.items():
            if study.bounds.get(name, 0.0) > 0.0:
                lines.append(_row(study, method, name, samples))
    coverage = [_coverage(s) for n, s in study.samples["likelihood"].items() if n in study.bounds]
    lines += [
        "",
        f"Likelihood, {study.count} realisations: {study.failures['likelihood']} fits failed; "
        f"RMSE/bound is {max(_ratios(study)):.2f} at most; coverage is "
        f"{100 * np.mean(coverage):.1f} % on average, {100 * min(coverage):.1f} % at least.",
        "",
    ]
    return "\n".join(lines)


def _ratios(study: Study) -> list[float]:
    """RMSE over bound of every parameter of the likelihood."""
    told = {n: s for n, s in study.samples["likelihood"].items() if study.bounds.get(n, 0.0) > 0.0}
    return [
        float(np.sqrt(np.mean([one.error**2 for one in samples])) / study.bounds[name])
        for name, samples in told.items()
    ]


def _row(study: Study, method: str, name: str, samples: list[Sample]) -> str:
    errors = np.array([s.error for s in samples])
    truth, bound = study.truth[name], study.bounds[name]
    scale, unit = (1e3, "ms") if name == "te_delay" else (100.0 / truth, "%")
    cells = (
        name,
        f"{scale * bound:.3f} {unit}",
        method,
        f"{scale * errors.mean():+.3f}",
        f"{scale * errors.std():.3f}",
        f"{np.sqrt(np.mean(errors**2)) / bound:.2f}",
        f"{100 * _coverage(samples):.0f} %",
    )
    return f"| {' | '.join(cells)} |"


def _coverage(samples: list[Sample]) -> float:
    return float(np.mean([abs(s.error) < 1.96 * s.std for s in samples]))
