# SPDX-License-Identifier: MIT
"""The text of docs/accuracy.md."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.estimation.mismatch import SHOWN, Shift
from benchmarks.estimation.study import Sample, Study

HEAD = """# Accuracy of the estimators

Written by `make accuracy` from {count} noise realisations per case of the virtual dynamometer.
The bound is that of Cramér and Rao: the Fisher information at the truth, with the noise of
outputs and inputs and the priors of the card in it, computed by disturbing every input sample of
the simulation; nothing of it is taken from the fits. Design values that the card knows only
roughly are drawn about the truth. Coverage is that of the stated 95 % intervals from noise.
"""


MISMATCH = """## What faults do that nobody states

Shift of the mean of {count} realisations against the same seeds without the fault, in %; the age of
the engine torque in ms. `chi2` is Q per sample without and with the fault: it does not warn. Jo′
± 10 %, P0 known.
"""


def page(
    studies: Sequence[tuple[Study, str]], shifts: Sequence[Shift], counts: tuple[int, int]
) -> str:
    """The whole page; `counts` are the realisations of a study and of a fault."""
    parts = [HEAD.format(count=counts[0])]
    parts += [_section(study, text) for study, text in studies]
    return "\n".join([*parts, MISMATCH.format(count=counts[1]), *_faults(shifts), ""])


def _faults(shifts: Sequence[Shift]) -> list[str]:
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
        f"Likelihood: {study.failures['likelihood']} fits failed; coverage is "
        f"{100 * np.mean(coverage):.1f} % on average, {100 * min(coverage):.1f} % at least.",
        "",
    ]
    return "\n".join(lines)


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
