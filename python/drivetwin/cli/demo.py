# SPDX-License-Identifier: MIT
"""`drivetwin demo`: the main job on a log with known truth, both methods side by side."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drivetwin._util.display_units import format_uncertainty, get_display_unit
from drivetwin._util.request import output_folder
from drivetwin.cli.arguments import REPORT
from drivetwin.cli.synth import Bench
from drivetwin.dyno.names import ScenarioName
from drivetwin.estimation.result.method import DEFAULT_METHOD, Method
from drivetwin.report.blocks import Column, TableBlock, TextBlock, make_table
from drivetwin.report.outcome import Outcome

if TYPE_CHECKING:
    from drivetwin.dyno.truth import Truth
    from drivetwin.estimation.identification import Identification

Interval = tuple[float, float]

_EXACT = 1e-5
"""Relative half width below which a value is printed as exact."""


def format_estimate(
    value: float | None, interval: Interval | None, si_unit: str
) -> tuple[str, str, str]:
    """Value, `± half width` of its interval, and the unit they are in; a dash for None."""
    display = get_display_unit(si_unit)
    if value is None:
        return "–", "", display.label
    half = None if interval is None else (interval[1] - interval[0]) / 2.0 * display.factor
    if half is not None and half < _EXACT * abs(value * display.factor):
        half = None
    number, width = format_uncertainty(value * display.factor, half)
    return number, f"± {width}" if width else "", display.label


def format_deviation(value: float | None, truth: float) -> str:
    """Format the deviation from the true value in percent; empty if undefined."""
    return "" if value is None or truth == 0.0 else f"{100.0 * (value / truth - 1.0):+z.2f}"


_METHODS = (DEFAULT_METHOD, Method.PAPER)
_SLIPS = (10.0, 30.0, 50.0, 80.0)
"""Slips [rad/s] at which friction coefficients are compared."""


class Demonstrate(Bench, command="demo"):
    """Arguments of `demo`."""

    output: Path = output_folder("Folder for all files.", default=Path("drivetwin-demo"))


def demo(request: Demonstrate) -> Outcome:
    """Identify a synthetic log with known truth by two methods, and compare."""
    from drivetwin.cli.identify_run import IdentifyOptions, run_identification, write_outcome
    from drivetwin.cli.synth import write_run
    from drivetwin.dyno.dyno import run as run_dyno
    from drivetwin.dyno.scenario_file import load_scenario

    scenario, output = request.scenario, request.output
    bench = run_dyno(load_scenario(scenario), request.seed, noise=request.noise)
    log, card, _ = write_run(output / f"{scenario}.csv", bench)
    outcomes = {
        method: run_identification(log, IdentifyOptions(vehicle=card, method=method))
        for method in _METHODS
    }
    for method, outcome in outcomes.items():
        write_outcome(outcome, output / method)
    found = {method: outcome.found for method, outcome in outcomes.items()}
    rows = _compare(bench.truth, found)
    report = output / DEFAULT_METHOD / REPORT
    note = "± is the half width of the 95 % interval; the paper's method states none for its grids."
    return Outcome(
        [_build_table(rows, scenario), TextBlock(note)],
        {"parameters": [row.to_document() for row in rows], "log": log, "report": report},
        lines=[f"log, card and truth: {log.parent}", f"report: {report}"],
    )


@dataclass(frozen=True)
class _Found:
    """Value and total 95 % interval of one method; None if not estimated."""

    value: float | None = None
    interval: tuple[float, float] | None = None


@dataclass(frozen=True)
class _Row:
    """One quantity: id, true value, what each method found, SI unit."""

    id: str
    truth: float
    found: Mapping[Method, _Found]
    unit: str

    def to_document(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "id": self.id,
            "truth": self.truth,
            "unit": self.unit,
            **{
                method.value: {"value": one.value, "ci95_total": one.interval}
                for method, one in self.found.items()
            },
        }


def _compare(truth: Truth, found: Mapping[Method, Identification]) -> list[_Row]:
    """Rows for all true parameters that some method answers, then friction over slip."""
    import numpy as np

    from drivetwin.parameters import get_parameter_spec

    rows = [
        _Row(
            key,
            value,
            {m: _get_estimate(one, key) for m, one in found.items()},
            get_parameter_spec(key).unit,
        )
        for key, value in truth.parameters.items()
        if any(key in one.estimates for one in found.values())
    ]
    for element, law in truth.friction.items():
        for slip in _SLIPS:
            points = {method: _get_friction(one, element, slip) for method, one in found.items()}
            if any(point.value is not None for point in points.values()):
                rows.append(
                    _Row(
                        f"mu.{element} @{slip:g}", float(law.evaluate(np.array(slip))), points, "1"
                    )
                )
    return rows


def _get_estimate(found: Identification, key: str) -> _Found:
    estimate = found.estimates.get(key)
    return _Found() if estimate is None else _Found(estimate.value, estimate.ci95_total)


def _get_friction(found: Identification, element: str, slip: float) -> _Found:
    """The curve of an element at one slip; nothing outside the slip range seen."""
    import numpy as np

    curve = found.friction.get(element)
    if curve is None or not curve.slip[0] <= slip <= curve.slip[-1]:
        return _Found()
    mu, low, high = (
        float(np.interp(slip, curve.slip, values))
        for values in (curve.mu, curve.mu_lo, curve.mu_hi)
    )
    return _Found(mu, (low, high) if np.isfinite(high - low) else None)


def _build_table(rows: list[_Row], scenario: ScenarioName) -> TableBlock:
    """Truth, and value, interval and deviation of both methods."""

    lines = []
    for row in rows:
        paper, default = row.found[Method.PAPER], row.found[DEFAULT_METHOD]
        value, interval, unit = format_estimate(default.value, default.interval, row.unit)
        lines.append(
            (
                row.id,
                format_estimate(row.truth, None, row.unit)[0],
                format_estimate(paper.value, None, row.unit)[0],
                format_deviation(paper.value, row.truth),
                *(value, interval, format_deviation(default.value, row.truth), unit),
            )
        )
    numbers = ("truth", "paper", "off %", DEFAULT_METHOD.value, "± 95 %", "off %")
    columns: Sequence[Column] = ("parameter", *((name, "s") for name in numbers), "unit")
    return make_table(f"Scenario {scenario}: truth and estimates", columns, lines)
