# SPDX-License-Identifier: MIT
"""The text of docs/accuracy.md, section by section."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from benchmarks.estimation.mismatch import SHOWN, Shift
from benchmarks.estimation.starts import OFF, Outcome
from benchmarks.estimation.study import Sample, Study
from benchmarks.estimation.unseen import HALF, Log, collect
from drivetwin._util.arrays import FloatArray

HEAD = """# Accuracy of the estimator

![Error over bound and coverage of each parameter by case](img/accuracy.svg)

Each dot is a row of the tables below, with the commit of its section
(`python -m tools.theory_figures`). The errors of the likelihood method are close to the bound. Dots
inside the grey band agree with 95 % coverage.

Written by `make accuracy` from noise realisations of the virtual dynamometer, others in every case.
The bound is that of Cramér and Rao: the Fisher information at the truth, with the noise of
outputs and inputs and the priors of the card in it, computed by disturbing every input sample of
the simulation. Nothing of it is taken from the fits. It takes for known whether signals are
samples or means, which the fits decide; that costs the delay of the engine torque some of its
bound. Design values that the card knows only roughly are drawn about the truth. Coverage is that of
the stated 95 % intervals from noise.
From n realisations RMSE/bound has a standard error of 1/√(2n), coverage one of √(475/n) %.
Each section names the code that it is from. One that names none is older than the choice between
samples and means, curves and lines, and than the off-going element's own drop of friction.
"""

STARTS = """## From bad start values

Every start value is drawn evenly within ± {off:.0f} % of the truth, those of P0 are the card's.
*right* means that every parameter lies inside the 95 % interval of the fit that starts at the
truth; a *refused* try says that it failed.

| tries | right | refused | wrong |
|---|---|---|---|
| {tries} | {right} | {refused} | {wrong} |
"""

UNSEEN = """## Vehicles drawn at random

{count} vehicles (`benchmarks/estimation/vehicles.py`): ratios, inertias, shaft, friction of both
elements, pedal, pressures, sensors, and what the card knows are drawn; the log file is read and
identified as by `drivetwin identify`. Error over stated standard deviation: its root mean square is
1 and 95 % lie within 1.96 where intervals are true. Width over bound: stated standard deviation
from noise over its Cramér-Rao bound, the median and what 90 % of the logs stay below. The last
columns are of the same logs read by sensors with errors of gain and offset (engine torque 2 % and
5 N·m, output torque 1 % and 20 N·m, pressures 0.5 % and 0.02 bar, one standard deviation each,
stated on the card), against the total deviation.

| parameter | logs | root mean square | within | width/bound | 90 % | with sensor errors | within |
|---|---|---|---|---|---|---|---|
"""

MISMATCH = """## What faults do that nobody states

Shift of the mean of {count} realisations against the same seeds without the fault, in %; the delay
of the engine torque in ms. `chi2` is Q per sample without and with the fault: it does not warn. Jo′
± 10 %, P0 known.
"""


def _format_row(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


def _format_header(*cells: str) -> list[str]:
    return [_format_row(*cells), "|" + "---|" * len(cells)]


def update_page(page: str, section: str) -> str:
    """Return `page` with `section` in place of the one of the same heading, else at its end."""
    heading = section.partition("\n")[0]
    parts = [f"## {part}" for part in page.split("\n## ")[1:]]
    titles = [part.partition("\n")[0] for part in parts]
    if heading in titles:
        parts[titles.index(heading)] = section
    else:
        parts.append(section)
    return "\n".join([HEAD, *(part.rstrip("\n") + "\n" for part in parts)])


def format_starts(outcomes: Counter[Outcome]) -> str:
    """Return the section on bad start values."""
    return STARTS.format(
        off=100 * OFF,
        tries=outcomes.total(),
        right=outcomes[Outcome.RIGHT],
        refused=outcomes[Outcome.REFUSED],
        wrong=outcomes[Outcome.WRONG],
    )


def format_unseen(logs: Sequence[Log]) -> str:
    """Return the section on vehicles drawn at random."""
    lines = [UNSEEN.format(count=len(logs)).rstrip("\n")]
    by_name = _add_all(collect([log.deviates for log in logs]))
    misread = _add_all(collect([log.misread for log in logs]))
    widths = _add_all(collect([log.widths for log in logs]))
    for name, deviates in by_name.items():
        median, most = np.quantile(widths[name], [0.5, 0.9])
        width = (f"{median:.2f}", f"{most:.2f}")
        lines.append(
            _format_row(
                name,
                f"{deviates.size}",
                *_format_deviates(deviates),
                *width,
                *_format_deviates(misread[name]),
            )
        )
    failures = [log.failure for log in logs if log.failure]
    refused = Counter(name for log in logs for name in log.refused)
    named = ", ".join(f"{name} {count}" for name, count in refused.items())
    needlessly = sum(len(log.needlessly) for log in logs)
    lines += [
        "",
        f"Fits failed: {len(failures)}. Refused by so many logs: {named}; of these {needlessly} "
        "whose bound is less than half of what is refused for its width.",
        "",
    ]
    return "\n".join(lines)


def _add_all(by_name: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Add the values of all parameters together, as the last entry."""
    return {**by_name, "all": np.concatenate(list(by_name.values()))}


def _format_deviates(deviates: FloatArray) -> tuple[str, str]:
    """Return root mean square and share within the 95 % interval."""
    within = 100.0 * float(np.mean(np.abs(deviates) < HALF))
    return f"{np.sqrt(np.mean(deviates**2)):.2f}", f"{within:.0f} %"


def format_faults(shifts: Sequence[Shift], count: int) -> str:
    """Return the section on faults, from `count` realisations of each."""
    lines = [MISMATCH.format(count=count), *_format_header("fault", *SHOWN, "te_delay", "chi2")]
    for one in shifts:
        cells = [f"{one.percent[name]:+.2f}" for name in SHOWN]
        chi2 = f"{one.chi2[0]:.3f} → {one.chi2[1]:.3f}"
        lines.append(_format_row(one.fault.text, *cells, f"{one.delay:+.2f}", chi2))
    return "\n".join([*lines, ""])


def format_study(study: Study, text: str) -> str:
    """Return the section of a study; `text` describes the design data of the card."""
    head = ("parameter", "bound", "bias", "std", "RMSE/bound", "coverage")
    lines = [f"## {study.name}: {text}", "", *_format_header(*head)]
    for name, samples in study.samples.items():
        if study.bounds.get(name, 0.0) > 0.0:
            lines.append(_format_estimate(study, name, samples))
    coverage = [_compute_coverage(s) for n, s in study.samples.items() if n in study.bounds]
    lines += [
        "",
        f"{study.count} realisations: {study.failures} fits failed; "
        f"RMSE/bound is {max(_compute_ratios(study)):.2f} at most; coverage is "
        f"{100 * np.mean(coverage):.1f} % on average, {100 * min(coverage):.1f} % at least.",
        "",
    ]
    return "\n".join(lines)


def _compute_ratios(study: Study) -> list[float]:
    """Return RMSE over bound of every parameter."""
    bounded = {n: s for n, s in study.samples.items() if study.bounds.get(n, 0.0) > 0.0}
    return [
        float(np.sqrt(np.mean([one.error**2 for one in samples])) / study.bounds[name])
        for name, samples in bounded.items()
    ]


def _format_estimate(study: Study, name: str, samples: list[Sample]) -> str:
    errors = np.array([s.error for s in samples])
    truth, bound = study.truth[name], study.bounds[name]
    scale, unit = (1e3, "ms") if name == "te_delay" else (100.0 / truth, "%")
    return _format_row(
        name,
        f"{scale * bound:.3f} {unit}",
        f"{scale * errors.mean():+.3f}",
        f"{scale * errors.std():.3f}",
        f"{np.sqrt(np.mean(errors**2)) / bound:.2f}",
        f"{100 * _compute_coverage(samples):.0f} %",
    )


def _compute_coverage(samples: list[Sample]) -> float:
    return float(np.mean([abs(s.error) < 1.96 * s.std for s in samples]))
