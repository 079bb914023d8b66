# SPDX-License-Identifier: MIT
"""`drivetwin demo`: the main job on a log with known truth, both methods side by side."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from drivetwin.cli.output import (
    JsonFlag,
    make_table,
    print_json,
    print_line,
    print_paragraph,
    print_table,
)
from drivetwin.cli.outputs import Output, Shape
from drivetwin.cli.synth import NoiseOption, ScenarioOption, SeedOption
from drivetwin.dyno.names import ScenarioName
from drivetwin.estimation.result.method import DEFAULT_METHOD, Method

if TYPE_CHECKING:
    from rich.table import Table

    from drivetwin.cli.comparison import Row

_METHODS = (DEFAULT_METHOD, Method.PAPER)


def demo(
    output: Annotated[
        Path,
        Output(Shape.FOLDER),
        typer.Option("-o", "--output", metavar="DIR", help="Folder for all files."),
    ] = Path("drivetwin-demo"),
    scenario: ScenarioOption = ScenarioName.PAPER_STEPS,
    seed: SeedOption = 0,
    noise: NoiseOption = 1.0,
    as_json: JsonFlag = False,
) -> None:
    """Identify a synthetic log with known truth by two methods, and compare."""
    from drivetwin.cli.arguments import REPORT
    from drivetwin.cli.comparison import compare
    from drivetwin.cli.identify_run import Request, run_identification, write_outcome
    from drivetwin.cli.synth import write_run
    from drivetwin.dyno.dyno import run as run_dyno
    from drivetwin.dyno.scenario_file import load_scenario

    bench = run_dyno(load_scenario(scenario), seed, noise=noise)
    log, card, _ = write_run(output / f"{scenario}.csv", bench)
    outcomes = {method: run_identification(log, Request(card, None, method)) for method in _METHODS}
    for method, outcome in outcomes.items():
        write_outcome(outcome, output / method)
    found = {method: outcome.found for method, outcome in outcomes.items()}
    rows = compare(bench.truth, found)
    report = output / DEFAULT_METHOD / REPORT
    if as_json:
        print_json(
            {"parameters": [row.to_document() for row in rows], "log": log, "report": report}
        )
        return
    print_table(_build_table(rows, scenario))
    print_paragraph(
        "± is the half width of the 95 % interval; the paper's method states none for its grids."
    )
    print_line(f"log, card and truth: {log.parent}")
    print_line(f"report: {report}")


def _build_table(rows: list[Row], scenario: ScenarioName) -> Table:
    """Truth, and value, interval and deviation of both methods."""
    from drivetwin.cli.numbers import format_deviation, format_estimate

    table = make_table(
        f"Scenario {scenario}: truth and estimates",
        "parameter", "truth", "paper", "off %",
        DEFAULT_METHOD, "95 %", "off %", "unit",
        right=("truth", "paper", "off %", DEFAULT_METHOD, "95 %"),
    )  # fmt: skip
    for row in rows:
        paper, default = row.found[Method.PAPER], row.found[DEFAULT_METHOD]
        value, interval, unit = format_estimate(default.value, default.interval, row.unit)
        table.add_row(
            row.id,
            format_estimate(row.truth, None, row.unit)[0],
            format_estimate(paper.value, None, row.unit)[0],
            format_deviation(paper.value, row.truth),
            value,
            interval,
            format_deviation(default.value, row.truth),
            unit,
        )
    return table
