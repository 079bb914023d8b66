# SPDX-License-Identifier: MIT
"""Tables of shifts, parameters and fits as the commands print them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from drivetwin.cli.numbers import (
    format_estimate,
    format_half_width,
    format_percent,
    format_quantity,
)
from drivetwin.cli.output import make_table
from drivetwin.estimation.result.estimate import Z95
from drivetwin.report.labels import get_channel_unit
from drivetwin.shifts.quality import QUALITY_UNITS
from drivetwin.shifts.summary import SUMMARIZED

if TYPE_CHECKING:
    from rich.table import Table

    from drivetwin.estimation.result.estimate import Estimate, FrictionCurve, SignalFit
    from drivetwin.estimation.result.suggestion import ExperimentRanking
    from drivetwin.shifts.shift import Shift
    from drivetwin.shifts.summary import ShiftGroup

_BESIDE = 3
"""So many shifts beside each other in a table."""

_PHASES = ("all", "before", "torque", "inertia", "after")


def build_shift_table(shifts: Sequence[Shift], source: str) -> Table:
    """One row for each phase of each shift, with the 95 % interval of its start."""
    table = make_table(
        f"Shifts in {source}", "shift", "phase", "from s", "95 %", "to s",
        right=("from s", "95 %", "to s"),
    )  # fmt: skip
    for shift in shifts:
        phases = (
            (f"gear {shift.start_gear}, {shift.offgoing} locked", shift.before, None),
            ("torque phase", shift.torque_phase, "torque_start"),
            ("inertia phase", shift.inertia_phase, "inertia_start"),
            (f"gear {shift.end_gear}, {shift.oncoming} locked", shift.after, "lockup"),
        )
        for index, (phase, (start, end), boundary) in enumerate(phases):
            sigma = shift.sigma.get(boundary) if boundary else None
            table.add_row(
                f"{shift.start_gear}→{shift.end_gear} {shift.kind}" if index == 0 else "",
                phase,
                f"{start:z.3f}",
                "" if sigma is None else f"± {1e3 * Z95 * sigma:.1f} ms",
                f"{end:z.3f}",
            )
    return table


def build_summary_tables(groups: Sequence[ShiftGroup]) -> Iterator[Table]:
    """Build one table for each figure: count, mean, spread and worst by kind and gears."""
    numbers = ("shifts", "mean", "spread", "worst", "at s")
    for figure in SUMMARIZED:
        rows = [(one, one.figures[figure]) for one in groups if figure in one.figures]
        if not rows:
            continue
        unit = QUALITY_UNITS[figure]
        title = f"{figure.replace('_', ' ').capitalize()} by kind of shift"
        table = make_table(title, "kind", "gears", *numbers, right=numbers)
        for group, one in rows:
            table.add_row(
                group.kind.value,
                group.gears or "all",
                str(one.count),
                format_quantity(one.mean, unit),
                "" if one.spread is None else format_quantity(one.spread, unit),
                format_quantity(one.worst, unit),
                f"{one.worst_time:z.2f}",
            )
        yield table


def build_quality_tables(shifts: Sequence[Shift]) -> Iterator[Table]:
    """Build tables of shift quality, one column for each shift; split if there are many."""
    for first in range(0, len(shifts), _BESIDE):
        part = shifts[first : first + _BESIDE]
        names = [f"{one.start_gear}→{one.end_gear}, {one.lockup_time:z.2f} s" for one in part]
        table = make_table("Shift quality", "figure", *names, right=tuple(names))
        for figure, unit in QUALITY_UNITS.items():
            if any(figure in one.quality for one in part):
                values = [format_quantity(one.quality.get(figure), unit) for one in part]
                table.add_row(figure.replace("_", " "), *values)
        yield table


def build_parameter_table(estimates: Mapping[str, Estimate], title: str) -> Table:
    """Value, 95 % interval with sensor tolerances, unit, verdict and the remark's number."""
    table = make_table(
        title, "parameter", "value", "95 %", "unit", "verdict", right=("value", "95 %")
    )
    numbers = _number_reasons(estimates)
    for estimate in estimates.values():
        value, interval, unit = format_estimate(estimate.value, estimate.ci95_total, estimate.unit)
        remark = f" ({numbers[estimate.reason]})" if estimate.reason else ""
        table.add_row(estimate.id, value, interval, unit, estimate.verdict.value + remark)
    return table


def list_remarks(estimates: Mapping[str, Estimate]) -> list[str]:
    """List the reasons of the verdicts as numbered lines, each reason once."""
    return [f"({number}) {reason}" for reason, number in _number_reasons(estimates).items()]


def _number_reasons(estimates: Mapping[str, Estimate]) -> dict[str, int]:
    """The different reasons, numbered from 1 in the order of the parameters."""
    reasons = dict.fromkeys(one.reason for one in estimates.values() if one.reason)
    return {reason: number for number, reason in enumerate(reasons, start=1)}


def build_suggestion_table(
    suggestions: Sequence[ExperimentRanking], estimates: Mapping[str, Estimate]
) -> Table:
    """By parameter the experiment and the number of the card that would narrow it most, with the
    interval now and then."""
    table = make_table(
        "Narrower intervals", "parameter", "now", "by the experiment", "then",
        "or exact on the card", "then ", "unit", right=("now", "then", "then "),
    )  # fmt: skip
    for one in suggestions:
        estimate, best, number = estimates[one.parameter], one.best, one.best_number
        if best is None and number is None:
            continue
        widths = (
            one.half_width,
            math.inf if best is None else best.half_width,
            math.inf if number is None else number.share * one.half_width,
        )
        now, then, known = (format_half_width(width, estimate.unit) for width in widths)
        table.add_row(
            one.parameter,
            now,
            "–" if best is None else one.text,
            "" if best is None else then,
            "–" if number is None else number.text,
            "" if number is None else known,
            format_estimate(None, None, estimate.unit)[2],
        )
    return table


def list_limits(suggestions: Sequence[ExperimentRanking]) -> list[str]:
    """List why no experiment narrows some parameters, each reason once with its parameters."""
    reasons: dict[str, list[str]] = {}
    for one in suggestions:
        if one.best is None:
            reasons.setdefault(one.text, []).append(one.parameter)
    return [f"{', '.join(names)}: {reason}" for reason, names in reasons.items()]


def build_friction_table(friction: Mapping[str, FrictionCurve]) -> Table:
    """μ with its 95 % band at the ends and in the middle of the slip range seen, and its verdict.

    μ is for the gain on the vehicle card; the log determines μ times the gain.
    """
    table = make_table(
        "Friction, for the gains on the vehicle card",
        "element", "slip rad/s", "μ", "95 %", "verdict", right=("slip rad/s", "μ", "95 %"),
    )  # fmt: skip
    for name, curve in friction.items():
        element = f"{name} ({curve.symbol})" if curve.over_eta else name
        for place, index in enumerate((0, curve.slip.size // 2, curve.slip.size - 1)):
            band = (float(curve.mu_lo[index]), float(curve.mu_hi[index]))
            value, interval, _ = format_estimate(float(curve.mu[index]), band, "1")
            first = (element, curve.verdict_text) if place == 0 else ("", "")
            table.add_row(first[0], f"{curve.slip[index]:z.1f}", value, interval, first[1])
    return table


def build_fit_table(fit: Mapping[str, Mapping[str, SignalFit]], title: str) -> Table:
    """Fit in percent by phase, and the root mean square error over all of it."""
    table = make_table(title, "fit %", *_PHASES, "rmse", right=(*_PHASES, "rmse"))
    for signal, phases in fit.items():
        cells = [
            format_percent(phases[name].fit_percent if name in phases else None) for name in _PHASES
        ]
        rmse = phases["all"].rmse if "all" in phases else None
        unit = get_channel_unit(signal)
        table.add_row(signal, *cells, format_quantity(rmse, unit))
    return table
