# SPDX-License-Identifier: MIT
"""Tables of shifts, parameters and fits as the commands print them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

from drivetwin.cli.numbers import around, percent, quantity, shown
from drivetwin.cli.output import table_of
from drivetwin.estimation.result.estimate import Z95
from drivetwin.report.labels import channel_unit
from drivetwin.shifts.quality import QUALITY_UNITS

if TYPE_CHECKING:
    from rich.table import Table

    from drivetwin.estimation.result.estimate import Estimate, FrictionCurve, SignalFit
    from drivetwin.estimation.result.suggestion import Suggestion
    from drivetwin.shifts.shift import Shift

_BESIDE = 3
"""So many shifts beside each other in a table."""

_PHASES = ("all", "before", "torque", "inertia", "after")


def shift_table(shifts: Sequence[Shift], source: str) -> Table:
    """One row for each phase of each shift, with the 95 % interval of its start."""
    table = table_of(
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
                f"{start:.3f}",
                "" if sigma is None else f"± {1e3 * Z95 * sigma:.1f} ms",
                f"{end:.3f}",
            )
    return table


def quality_tables(shifts: Sequence[Shift]) -> Iterator[Table]:
    """Build tables of shift quality, one column for each shift; split if there are many."""
    for first in range(0, len(shifts), _BESIDE):
        part = shifts[first : first + _BESIDE]
        names = [f"{one.start_gear}→{one.end_gear}, {one.lockup_time:.2f} s" for one in part]
        table = table_of("Shift quality", "figure", *names, right=tuple(names))
        for figure, unit in QUALITY_UNITS.items():
            if any(figure in one.quality for one in part):
                values = [quantity(one.quality.get(figure), unit) for one in part]
                table.add_row(figure.replace("_", " "), *values)
        yield table


def parameter_table(estimates: Mapping[str, Estimate], title: str) -> Table:
    """Value, 95 % interval with sensor tolerances, unit, verdict and the remark's number."""
    table = table_of(
        title, "parameter", "value", "95 %", "unit", "verdict", right=("value", "95 %")
    )
    numbers = _numbers(estimates)
    for estimate in estimates.values():
        value, interval, unit = shown(estimate.value, estimate.ci95_total, estimate.unit)
        remark = f" ({numbers[estimate.reason]})" if estimate.reason else ""
        table.add_row(estimate.id, value, interval, unit, estimate.verdict.value + remark)
    return table


def remarks(estimates: Mapping[str, Estimate]) -> list[str]:
    """List the reasons of the verdicts as numbered lines, each reason once."""
    return [f"({number}) {reason}" for reason, number in _numbers(estimates).items()]


def _numbers(estimates: Mapping[str, Estimate]) -> dict[str, int]:
    """The different reasons, numbered from 1 in the order of the parameters."""
    reasons = dict.fromkeys(one.reason for one in estimates.values() if one.reason)
    return {reason: number for number, reason in enumerate(reasons, start=1)}


def suggestion_table(suggestions: Sequence[Suggestion], estimates: Mapping[str, Estimate]) -> Table:
    """By parameter the experiment that would narrow it most, with the interval now and then."""
    table = table_of(
        "What would tell more", "parameter", "now", "experiment", "then", "unit",
        right=("now", "then"),
    )  # fmt: skip
    for one in suggestions:
        estimate = estimates[one.parameter]
        unit, best = estimate.unit, one.best
        then = "" if best is None else around(estimate.value, best.half_width, unit)
        now = around(estimate.value, one.half_width, unit)
        table.add_row(one.parameter, now, one.text, then, shown(None, None, unit)[2])
    return table


def friction_table(friction: Mapping[str, FrictionCurve]) -> Table:
    """μ with its 95 % band at the ends and in the middle of the slip range seen."""
    table = table_of(
        "Friction", "element", "slip rad/s", "μ", "95 %", right=("slip rad/s", "μ", "95 %")
    )
    for name, curve in friction.items():
        element = f"{name} ({curve.symbol})" if curve.over_eta else name
        for place, index in enumerate((0, curve.slip.size // 2, curve.slip.size - 1)):
            band = (float(curve.mu_lo[index]), float(curve.mu_hi[index]))
            value, interval, _ = shown(float(curve.mu[index]), band, "1")
            table.add_row(
                element if place == 0 else "", f"{curve.slip[index]:.1f}", value, interval
            )
    return table


def fit_table(fit: Mapping[str, Mapping[str, SignalFit]], title: str) -> Table:
    """Fit in percent by phase, and the root mean square error over all of it."""
    table = table_of(title, "fit %", *_PHASES, "rmse", right=(*_PHASES, "rmse"))
    for signal, phases in fit.items():
        cells = [percent(phases[name].fit_percent if name in phases else None) for name in _PHASES]
        rmse = phases["all"].rmse if "all" in phases else None
        unit = channel_unit(signal)
        table.add_row(signal, *cells, quantity(rmse, unit))
    return table
