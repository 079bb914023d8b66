# SPDX-License-Identifier: MIT
"""Sections and pictures of docs/work-precision.md, from benchmarks/results/precision.json."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from tools.result_blocks.chart import Point, draw_chart
from tools.result_blocks.origin import Raw, write_origin, write_table

_OURS, _READY, _FIRST, _CALLED = (
    *("drivetwin", "in Rust, ready", "in Rust, first run"),
    "default, from Python",
)
_UNITS = {"shift": "N·m", "stiff": "rad/s", "chain": "rad/s", "batch": "N·m"}
"""Units of the errors by problem."""
_SPAN_LIMIT = 1.5
"""Time of the fixed-step span over that of the C loop."""
_GROWTH_LIMIT = 2.0
"""Exponent of the time over the number of inertias."""


def _select(raw: Raw, problem: str) -> list[Mapping[str, Any]]:
    return [one for one in raw["entries"] if one["problem"] == problem]


def _find_time(raw: Raw, problem: str, peer: str, setting: str) -> float | None:
    """Return the least time of an entry [s]; None where it was not measured."""
    for one in _select(raw, problem):
        if (one["peer"], one["setting"]) == (peer, setting):
            return float(min(one["seconds"]))
    return None


def _write_problem(problem: str, raw: Raw) -> str:
    rows = []
    for one in sorted(_select(raw, problem), key=lambda one: min(one["seconds"])):
        error = one["error"]
        shown = "failed" if error is None else f"{error:.2g}"
        rows.append((one["peer"], one["setting"], f"{1e3 * min(one['seconds']):.4g}", shown))
    return write_table(("peer", "setting", "CPU ms", f"error, {_UNITS[problem]}"), rows)


def _draw_problem(problem: str, raw: Raw) -> str:
    lines: dict[str, list[Point]] = {}
    for one in _select(raw, problem):
        if one["error"]:
            name = one["peer"] + _name_method(one)
            lines.setdefault(name, []).append((1e3 * min(one["seconds"]), one["error"]))
    return draw_chart(lines, "CPU time, ms", f"largest error, {_UNITS[problem]}")


def _name_method(one: Mapping[str, Any]) -> str:
    """Name the method of a setting with a tolerance, or where drivetwin is called."""
    first, *rest = one["setting"].split(", ")
    if one["peer"] == _OURS:
        return " in Rust" if first == "in Rust" else " from Python"
    return f" {first}" if rest and one["peer"].startswith("SciPy") else ""


def _write_wins(raw: Raw) -> str:
    """List the entries of peers that are faster than drivetwin at no larger error."""
    rows = []
    for problem in _UNITS:
        ours = [one for one in _select(raw, problem) if one["peer"] == _OURS and one["error"]]
        for one in _select(raw, problem):
            if one["peer"] == _OURS or not one["error"]:
                continue
            equal = [min(own["seconds"]) for own in ours if own["error"] <= one["error"]]
            ratio = min(equal, default=math.inf) / min(one["seconds"])
            if ratio > 1.0:
                shown = f"{ratio:.2g}" if math.isfinite(ratio) else "no setting as exact"
                rows.append((problem, one["peer"], one["setting"], shown))
    if not rows:
        return "None.\n"
    return write_table(("problem", "peer", "setting", "time of drivetwin over its time"), rows)


def _write_span(raw: Raw) -> str:
    rows = []
    for problem, name in (("stiff", "3 inertias"), ("chain", "20 inertias")):
        base = _find_time(raw, problem, "C loop", "exponential precomputed")
        for setting in (_READY, _FIRST, _CALLED):
            own = _find_time(raw, problem, _OURS, setting)
            if base and own:
                limit = f"{_SPAN_LIMIT:g}" if setting == _READY else ""
                cells = (f"{1e6 * own:.3g}", f"{1e6 * base:.3g}", f"{own / base:.2f}", limit)
                rows.append((name, setting, *cells))
    return write_table(("driveline", "drivetwin", "µs", "C loop, µs", "ratio", "limit"), rows)


def _write_chains(raw: Raw) -> str:
    """Write times over the number of inertias, and the exponent between the largest two."""
    chains = raw["chains"]
    sizes = list(next(iter(chains.values())))
    rows = []
    for name, times in chains.items():
        (low, fast), (high, slow) = list(times.items())[-2:]
        exponent = math.log(slow / fast) / math.log(int(high) / int(low))
        cells = [f"{1e3 * times[size]:.3g}" for size in sizes]
        rows.append((name, *cells, f"{exponent:.2f}"))
    head: Sequence[str] = ("ms by number of inertias", *sizes, "exponent of the last two")
    return write_table(head, rows) + f"\nLimit of the exponent: {_GROWTH_LIMIT:g}.\n"


def _write_missing(raw: Raw) -> str:
    if not raw["missing"]:
        return "No peer was missing.\n"
    return "".join(f"Missing: {name}, as {why}.\n" for name, why in raw["missing"].items())


BLOCKS: dict[str, Callable[[Raw], str]] = {
    "origin": write_origin,
    "missing": _write_missing,
    "wins": _write_wins,
    "span": _write_span,
    "chains": _write_chains,
    **{problem: partial(_write_problem, problem) for problem in _UNITS},
}
PICTURES: dict[str, Callable[[Raw], str]] = {
    problem: partial(_draw_problem, problem) for problem in _UNITS
}
"""Pictures by problem."""
