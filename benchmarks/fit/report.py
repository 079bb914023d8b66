# SPDX-License-Identifier: MIT
"""Tables of the study as Markdown."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from benchmarks.fit.bound import Bound
from benchmarks.fit.problem import Problem
from benchmarks.fit.study import Summary

HEAD = (
    *("problem", "unknowns", "right minima", "RMSE/bound", "largest", "coverage"),
    *("CPU time, median [s]", "90 % [s]"),
)


def format_row(*cells: str) -> str:
    """Return a row of a table."""
    return f"| {' | '.join(cells)} |"


def format_header(*cells: str) -> str:
    """Return the head of a table with its rule."""
    return f"{format_row(*cells)}\n|{'---|' * len(cells)}"


def format_problem(problem: Problem, bound: Bound, summary: Summary) -> str:
    """Return the section of a problem: a row for each unknown."""
    lines = [
        f"## {problem.name}: {problem.text}",
        "",
        f"{len(problem.unknowns)} unknowns, {len(problem.open_start)} unknown start values, "
        f"{problem.time.size} samples of {len(problem.outputs)} outputs.",
        "",
        format_header(
            "unknown", "truth", "prior", "bound", "bound/prior", "RMSE/bound", "coverage"
        ),
    ]
    for name, one in problem.unknowns.items():
        std = bound.std[name]
        cells = [f"{one.truth:g}", f"{100 * one.spread:g} %", f"{100 * std:.3g} %"]
        cells.append(f"{std / one.spread:.3f}")
        cells.append(_format(summary.ratios, name, "{:.2f}"))
        cells.append(_format(summary.coverage, name, "{:.1%}"))
        lines.append(format_row(name, *cells))
    lines += ["", *(f"Failed: {failure}" for failure in summary.failures)]
    return "\n".join(lines)


def format_summary(found: Mapping[str, Summary]) -> str:
    """Return the table of all problems and the pooled figures."""
    lines = [format_header(*HEAD)]
    for name, one in found.items():
        cells = [f"{len(one.ratios)}", f"{one.right} of {one.count}"]
        cells.append(f"{one.mean_ratio:.2f}" if one.ratios else "-")
        cells.append(f"{max(one.ratios.values()):.2f}" if one.ratios else "-")
        cells.append(_format_share(*one.covered))
        cells += [f"{np.quantile(one.seconds, share):.2f}" for share in (0.5, 0.9)]
        lines.append(format_row(name, *cells))
    right = sum(one.right for one in found.values())
    count = sum(one.count for one in found.values())
    inside = sum(one.covered[0] for one in found.values())
    asked = sum(one.covered[1] for one in found.values())
    squares = [ratio**2 for one in found.values() for ratio in one.ratios.values()]
    lines += ["", f"Right minima: {right} of {count} ({_format_share(right, count)})."]
    if squares:
        lines.append(
            f"RMSE/bound over all unknowns: {np.sqrt(np.mean(squares)):.3f} in the root mean "
            f"square, {np.sqrt(max(squares)):.2f} at most."
        )
    lines.append(f"Pooled coverage: {_format_share(inside, asked)} of {asked} intervals.")
    return "\n".join(lines)


def _format(values: Mapping[str, float], name: str, form: str) -> str:
    return form.format(values[name]) if name in values else "-"


def _format_share(part: int, whole: int) -> str:
    return f"{100 * part / whole:.1f} %" if whole else "-"
