# SPDX-License-Identifier: MIT
"""`drivetwin fleet`: identification of many logs into a store, and queries of the store."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from drivetwin._util.outputs import PAGE
from drivetwin._util.request import (
    MEBIBYTE,
    REQUIRED,
    SECOND,
    Request,
    argument,
    flag,
    option,
    output_file,
    output_folder,
)
from drivetwin.cli.command_group import CommandGroup
from drivetwin.cli.output import (
    make_table,
    print_json,
    print_line,
    print_paragraph,
    print_table,
    show_step,
)
from drivetwin.errors import INTERRUPTED, InputError
from drivetwin.fleet.options import FleetOptions

if TYPE_CHECKING:
    from drivetwin.fleet.events import Summary
    from drivetwin.fleet.mixed_model.result import Change, JointEstimate, UnitValue

RUN = "run"


class FleetFiles(Request):
    """Logs, rules and store of a fleet run."""

    logs: tuple[str, ...] = argument("Files, folders and quoted globs.", "LOGS...", default=())
    vehicle: Path = option("Vehicle card, or rules (TOML).", metavar="CARD|RULES", default=REQUIRED)
    output: Path = output_folder("Folder of the store.", "STORE", REQUIRED)
    listed: Path | None = option(
        "CSV with a column 'path', or text with one path per line.", "--list", metavar="FILE"
    )


class RunFleet(FleetOptions, FleetFiles, command="fleet run"):
    """Arguments of `fleet run`."""

    as_json: bool = flag("Print one JSON event per line on stdout.", "--json")


class StoreInput(Request):
    """The store of a fleet."""

    store: Path = argument("Folder of 'fleet -o'.", "STORE")


def run(request: RunFleet) -> None:
    """Identify all logs that are not yet in the store.

    The same command continues an interrupted run; finished logs are not computed again.
    """
    from drivetwin.cli.fleet_view import show_progress
    from drivetwin.fleet.rules import read_rules
    from drivetwin.fleet.run import FleetRun, run_fleet
    from drivetwin.fleet.sources import Sources

    if not request.logs and request.listed is None:
        raise InputError("no logs are named", "give files, folders, a quoted glob or --list FILE")
    wanted = FleetRun(
        **request.select(FleetOptions),
        sources=Sources(request.logs, request.listed),
        rules=read_rules(request.vehicle),
        store=request.output,
    )
    with show_progress(as_json=request.as_json) as tell:
        summary = run_fleet(wanted, tell)
    if not request.as_json:
        _print_summary(summary, request.output)
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


class ReportFleet(StoreInput, command="fleet report"):
    """Arguments of `fleet report`."""

    output: Path | None = output_file(
        "Page to write; default: report.html in the store.", "FILE.html", PAGE
    )


def report(request: ReportFleet, *, as_json: bool) -> None:
    """Write the report of a store: shared values, ageing, units, outliers, failures."""
    from drivetwin.fleet.report import PAGE as REPORT
    from drivetwin.fleet.report import save_fleet_report
    from drivetwin.fleet.store import Store

    page = request.store / REPORT if request.output is None else request.output
    with show_step("estimating over the fleet"), Store(request.store) as opened:
        save_fleet_report(opened, page)
    if as_json:
        print_json({"report": page})
        return
    print_line(f"wrote {page}")


class EstimateFleet(StoreInput, command="fleet estimate"):
    """Arguments of `fleet estimate`."""

    parameter: tuple[str, ...] = option(
        "Parameter to estimate; repeatable; default: all.", metavar="ID", default=()
    )


def estimate(request: EstimateFleet, *, as_json: bool) -> None:
    """Estimate over all logs: shared values, spread over units, ageing, changes, outliers."""
    from drivetwin.fleet.mixed_model.estimate import estimate_fleet, list_missing_estimates
    from drivetwin.fleet.store import Store

    with show_step("estimating over the fleet"), Store(request.store) as opened:
        found = estimate_fleet(opened, request.parameter)
        missing = list_missing_estimates(opened, found, request.parameter)
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


class QueryFleet(StoreInput, command="fleet query"):
    """Arguments of `fleet query`."""

    sql: str = argument("SELECT over parameters, files, …", "SQL")
    output: Path | None = output_file(
        "Write the answer as .csv or .parquet.",
        "FILE",
        {".csv": "text table", ".parquet": "binary table"},
    )
    time_limit: float = option("Time limit of the query.", unit=SECOND, minimum=0.1, default=60.0)
    memory_limit: int = option(
        "Memory limit of the query.", unit=MEBIBYTE, minimum=64, default=2 * 2**30
    )


def query(request: QueryFleet, *, as_json: bool) -> None:
    """Query a store in SQL (DuckDB).

    Tables: parameters, frictions, fits, qualities, warnings, rows, files, logs, shifts, settings.
    """
    from drivetwin.fleet.query import query_store, save_answer
    from drivetwin.fleet.store import Store
    from drivetwin.fleet.task import Limits

    output, limits = request.output, Limits(request.time_limit, request.memory_limit)
    with show_step("asking"), Store(request.store) as opened:
        answer = query_store(opened, request.sql, limits)
    if output is not None:
        save_answer(answer, output, request.store)
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
