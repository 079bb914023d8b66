# SPDX-License-Identifier: MIT
"""`drivetwin fleet`: identification of many logs into a store, and queries of the store."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drivetwin.cli.command_group import CommandGroup
from drivetwin.cli.output import (
    JsonFlag,
    make_table,
    print_json,
    print_line,
    print_paragraph,
    print_table,
    show_step,
)
from drivetwin.cli.outputs import PAGE, Output, Shape
from drivetwin.errors import INTERRUPTED
from drivetwin.estimation.result.method import DEFAULT_METHOD, Method

if TYPE_CHECKING:
    from drivetwin.fleet.events import Summary
    from drivetwin.fleet.mixed_model.result import Change, JointEstimate, UnitValue

RUN = "run"


StoreFolder = Annotated[Path, typer.Argument(metavar="STORE", help="Folder of 'fleet -o'.")]


Logs = Annotated[
    list[str] | None, typer.Argument(metavar="LOGS...", help="Files, folders and quoted globs.")
]
CardOrRules = Annotated[
    Path, typer.Option("--vehicle", metavar="CARD|RULES", help="Vehicle card, or rules (TOML).")
]
StoreOption = Annotated[
    Path,
    Output(Shape.FOLDER),
    typer.Option("-o", "--output", metavar="STORE", help="Folder of the store."),
]
ListFile = Annotated[
    Path | None,
    typer.Option(
        "--list", metavar="FILE", help="CSV with a column 'path', or text with one path per line."
    ),
]
MethodOption = Annotated[
    Method, typer.Option(metavar="METHOD", help="paper, integral or likelihood.")
]
Workers = Annotated[
    int | None, typer.Option(min=1, help="Processes on this machine; default: one per core.")
]
Scheduler = Annotated[
    str | None, typer.Option(metavar="ADDRESS", help="Work on a Dask cluster, tcp://host:port.")
]
TimeLimit = Annotated[float, typer.Option(min=0.1, metavar="S", help="Time limit of one log.")]
MemoryLimit = Annotated[
    int, typer.Option(min=64, metavar="MIB", help="Memory limit of one worker.")
]
Attempts = Annotated[
    int, typer.Option(min=1, help="Number of attempts for a log that loses its worker.")
]
Retry = Annotated[bool, typer.Option("--retry", help="Retry the logs in quarantine.")]
Reports = Annotated[bool, typer.Option("--reports", help="Also write the report of each log.")]
Traces = Annotated[
    bool, typer.Option("--traces", help="Also write measured and simulated signals of each log.")
]
Events = Annotated[bool, typer.Option("--json", help="Print one JSON event per line on stdout.")]


def run(
    *,
    logs: Logs = None,
    vehicle: CardOrRules,
    output: StoreOption,
    listed: ListFile = None,
    method: MethodOption = DEFAULT_METHOD,
    workers: Workers = None,
    scheduler: Scheduler = None,
    time_limit: TimeLimit = 600.0,
    memory_limit: MemoryLimit = 4096,
    attempts: Attempts = 3,
    retry: Retry = False,
    reports: Reports = False,
    traces: Traces = False,
    as_json: Events = False,
) -> None:
    """Identify all logs that are not yet in the store.

    The same command continues an interrupted run; finished logs are not computed again.
    """
    from drivetwin.cli.fleet_view import show_progress
    from drivetwin.errors import InputError
    from drivetwin.fleet.coordinator import RunOptions
    from drivetwin.fleet.rules import read_rules
    from drivetwin.fleet.run import FleetRun, run_fleet
    from drivetwin.fleet.sources import Sources
    from drivetwin.fleet.task import Limits, WorkerSpec

    if not logs and listed is None:
        raise InputError("no logs are named", "give files, folders, a quoted glob or --list FILE")
    request = FleetRun(
        Sources(logs or [], listed),
        read_rules(vehicle),
        output,
        method,
        workers,
        scheduler,
        WorkerSpec(limits=Limits(time_limit, memory_limit * 2**20)),
        RunOptions(attempts, retry, reports, traces),
    )
    with show_progress(as_json=as_json) as tell:
        summary = run_fleet(request, tell)
    if not as_json:
        _print_summary(summary, output)
    if not summary.complete:
        raise typer.Exit(INTERRUPTED)


def _print_summary(summary: Summary, output: Path) -> None:
    table = make_table(f"Fleet in {output}", "logs", "", right=("",))
    rows = {
        "identified": summary.done,
        "bad": summary.bad,
        "in quarantine": summary.quarantined,
        "left out by the rules": summary.skipped,
        "computed in this run": summary.computed,
    }
    for name, count in rows.items():
        table.add_row(name, str(count))
    print_table(table)
    for name, count in summary.failures.items():
        print_paragraph(f"{count} {name}")
    if not summary.complete:
        print_line("interrupted; the same command goes on from here")
    elif summary.failures:
        print_line(f"reasons: drivetwin fleet query {output} \"SELECT path, what FROM files "
            "JOIN logs USING (log) WHERE error <> ''\"")  # fmt: skip


def report(
    store: StoreFolder,
    output: Annotated[
        Path | None,
        Output(endings=PAGE),
        typer.Option(
            "-o",
            "--output",
            metavar="FILE.html",
            help="Page to write; default: report.html in the store.",
        ),
    ] = None,
    as_json: JsonFlag = False,
) -> None:
    """Write the report of a store: shared values, ageing, units, outliers, failures."""
    from drivetwin.fleet.report import PAGE, save_fleet_report
    from drivetwin.fleet.store import Store

    page = store / PAGE if output is None else output
    with show_step("estimating over the fleet"), Store(store) as opened:
        save_fleet_report(opened, page)
    if as_json:
        print_json({"report": page})
        return
    print_line(f"wrote {page}")


def estimate(
    store: StoreFolder,
    parameter: Annotated[
        list[str] | None,
        typer.Option(
            "--parameter", metavar="ID", help="Parameter to estimate; repeatable; default: all."
        ),
    ] = None,
    as_json: JsonFlag = False,
) -> None:
    """Estimate over all logs: shared values, spread over units, ageing, changes, outliers."""
    from drivetwin.fleet.mixed_model.estimate import estimate_fleet, list_missing_estimates
    from drivetwin.fleet.store import Store

    with show_step("estimating over the fleet"), Store(store) as opened:
        found = estimate_fleet(opened, parameter or ())
        missing = list_missing_estimates(opened, found, parameter or ())
    if as_json:
        print_json({"estimates": [one.to_document() for one in found], "untold": missing})
        return
    _print_estimates(found)
    if missing:
        print_paragraph(f"too few logs have an estimate of: {', '.join(missing)}")


def _print_estimates(found: list[JointEstimate]) -> None:
    from drivetwin._util.display_units import format_significant, get_display_unit
    from drivetwin.cli.numbers import format_estimate

    rules = {one.rule for one in found}
    table = make_table(
        "Fleet", *(("rule",) if len(rules) > 1 else ()), "parameter", "value", "95 %", "unit",
        "spread", "drift", "95 % of it", "per",
        right=("value", "95 %", "spread", "drift", "95 % of it"),
    )  # fmt: skip
    for one in found:
        whose = (one.rule,) if len(rules) > 1 else ()
        value, interval, unit = format_estimate(one.value, one.ci95, one.si_unit)
        factor = get_display_unit(one.si_unit).factor
        spread = "" if one.spread is None else format_significant(one.spread * factor, 2)
        table.add_row(*whose, one.parameter, value, interval, unit, spread, *_describe_drift(one))
    print_table(table)
    for text in dict.fromkeys(text for one in found for text in one.notes):
        names = dict.fromkeys(one.parameter for one in found if text in one.notes)
        print_paragraph(text if len(names) == len({one.parameter for one in found}) else
             f"{', '.join(names)}: {text}")  # fmt: skip
    for one in found:
        for change in one.changes:
            print_paragraph(_describe_change(one, change))
        for member in one.units:
            if member.odd:
                print_paragraph(_describe_outlier(one, member))
        for outlier in one.outliers:
            print_paragraph(f"{one.parameter}: {Path(outlier.path).name}: {outlier.reason}")


def _describe_change(one: JointEstimate, change: Change) -> str:
    """Describe the change of a unit."""
    from drivetwin.fleet.rules import format_span

    step = _format_deviation(one, change.size, change.std)
    where = format_span(change.field, change.before, change.after)
    return f"{one.parameter}: unit {change.unit} changed by {step} between {where}"


def _describe_outlier(one: JointEstimate, unit: UnitValue) -> str:
    """Describe the deviation of a unit from the others."""
    from drivetwin.fleet.figures import format_unit

    return (
        f"{one.parameter}: unit {format_unit(one, unit)} is "
        f"{_format_deviation(one, unit.deviation, unit.std)} off, "
        f"{abs(unit.score or 0.0):.1f} standard "
        "deviations of the units; it counts in value and spread"
    )


def _format_deviation(one: JointEstimate, size: float, std: float) -> str:
    """A difference with its 95 % interval and unit."""
    from drivetwin.cli.numbers import format_estimate
    from drivetwin.estimation.result.estimate import Z95

    ends = (size - Z95 * std, size + Z95 * std)
    return " ".join(format_estimate(size, ends, one.si_unit)).removesuffix(" –")


def _describe_drift(one: JointEstimate) -> tuple[str, str, str]:
    """Drift over the first field, its interval, and per what it is."""
    from drivetwin.cli.numbers import format_estimate
    from drivetwin.fleet.rules import get_drift_unit

    if not one.drifts:
        return "", "", ""
    drift = one.drifts[0]
    factor, per = get_drift_unit(drift.field)
    ends = (drift.ci95[0] * factor, drift.ci95[1] * factor)
    return *format_estimate(drift.slope * factor, ends, one.si_unit)[:2], per


def query(
    store: StoreFolder,
    sql: Annotated[str, typer.Argument(metavar="SQL", help="SELECT over parameters, files, …")],
    output: Annotated[
        Path | None,
        Output(endings={".csv": "text table", ".parquet": "binary table"}),
        typer.Option(
            "-o", "--output", metavar="FILE", help="Write the answer as .csv or .parquet."
        ),
    ] = None,
    time_limit: Annotated[
        float, typer.Option(min=0.1, metavar="S", help="Time limit of the query.")
    ] = 60.0,
    memory_limit: Annotated[
        int, typer.Option(min=64, metavar="MIB", help="Memory limit of the query.")
    ] = 2048,
    as_json: JsonFlag = False,
) -> None:
    """Query a store in SQL (DuckDB).

    Tables: parameters, frictions, fits, qualities, warnings, rows, files, logs, shifts, settings.
    """
    from drivetwin.fleet.query import query_store, save_answer
    from drivetwin.fleet.store import Store
    from drivetwin.fleet.task import Limits

    limits = Limits(time_limit, memory_limit * 2**20)
    with show_step("asking"), Store(store) as opened:
        answer = query_store(opened, sql, limits)
    if output is not None:
        save_answer(answer, output, store)
    if as_json:
        rows = [dict(zip(answer.columns, row, strict=True)) for row in answer.rows]
        print_json({"rows": rows})
        return
    if output is not None:
        print_line(f"wrote {output}")
        return
    numbers = {
        name
        for name, column in zip(answer.columns, zip(*answer.rows, strict=True), strict=False)
        if all(isinstance(cell, int | float | None) for cell in column)
    }
    table = make_table("", *answer.columns, right=tuple(numbers))
    for row in answer.rows:
        table.add_row(*map(_format_cell, row))
    print_table(table)


def _format_cell(value: object) -> str:
    """A value of an answer as a person reads it; `-o` and `--json` give all digits."""
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else str(value)


class LogsOrCommand(CommandGroup):
    """`drivetwin fleet LOGS` is `drivetwin fleet run LOGS`: what is no command is a log."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Put in the command that is meant."""
        if args and args[0] not in (*self.commands, "--help"):
            args = [RUN, *args]
        return super().parse_args(ctx, args)


fleet = LogsOrCommand(
    name="fleet",
    entries={RUN: run, "report": report, "estimate": estimate, "query": query},
    help="Identify many logs into a store; report, estimate and query it. Runs can be resumed.",
)
