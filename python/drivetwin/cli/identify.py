# SPDX-License-Identifier: MIT
"""`drivetwin identify LOG...`: parameters with intervals and verdicts, twin and report."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drivetwin.cli.arguments import ChannelsFile, VehicleFile, require_logs
from drivetwin.cli.atomic_outputs import refuse_same_names
from drivetwin.cli.identify_run import Request
from drivetwin.cli.output import (
    JsonFlag,
    print_findings,
    print_json,
    print_line,
    print_paragraph,
    print_table,
    print_verdict,
    show_error,
    to_error_document,
)
from drivetwin.cli.outputs import Output, Shape
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.result.method import DEFAULT_METHOD, Method
from drivetwin.estimation.result.status import ModelStatus

if TYPE_CHECKING:
    from drivetwin.estimation.identification import Identification
    from drivetwin.shifts.shift import Shift


NOT_CONFIRMED = 3
"""Exit code of a model that is neither valid nor valid with limits, with --strict."""


def identify(
    logs: Annotated[
        list[Path],
        typer.Argument(metavar="LOG...", help="One or more shift logs.", callback=require_logs),
    ],
    vehicle: VehicleFile,
    channels: ChannelsFile = None,
    method: Annotated[
        Method, typer.Option(metavar="METHOD", help="paper, integral or likelihood.")
    ] = DEFAULT_METHOD,
    output: Annotated[
        Path | None,
        Output(Shape.FOLDER),
        typer.Option("-o", "--output", metavar="DIR", help="Folder for result, twin and report."),
    ] = None,
    together: Annotated[
        bool, typer.Option("--together", help="Fit all logs of one vehicle jointly.")
    ] = False,
    hold_out: Annotated[
        list[str] | None,
        typer.Option(
            metavar="SHIFT",
            help="Shift to predict instead of fit: its number, a LOG, or LOG:NUMBER; repeatable.",
        ),
    ] = None,
    effects: Annotated[
        list[str] | None,
        typer.Option(
            "--effect",
            metavar="NAME=STD",
            help="Prior of an effect that the model omits, such as tyre_slip=0.002; 0: no effect.",
        ),
    ] = None,
    strict: Annotated[
        bool,
        typer.Option(
            "--strict", help="Exit with code 3 unless every model is valid, limits included."
        ),
    ] = False,
    as_json: JsonFlag = False,
) -> None:
    """Identify the driveline from shift logs.

    With -o, write DIR/result.json, DIR/twin.toml and DIR/report.html. Several logs are identified
    one by one, each into DIR/NAME-OF-LOG. If a log cannot be identified, it is reported and the
    exit code is 2; the other logs get their results.

    With --together, one driveline is fitted to all logs; load and engine-torque delay are specific
    to each log. With --hold-out, which implies --together, a log or shift takes no part in the fit.
    It is simulated with the parameters of the others and compared.
    """
    how = Request(vehicle, channels, method, tuple(effects or ()))
    if together or hold_out:
        status = _identify_joint(logs, how, hold_out or [], output, as_json)
        _exit_by_status([status], strict)
        return
    folders = _choose_folders(logs, output)
    results: list[dict[str, Any]] = []
    failed: DrivetwinError | None = None
    for log in logs:
        try:
            results.append(_identify_log(log, how, folders.get(log), as_json))
        except DrivetwinError as error:
            error.where = replace(error.where, file=error.where.file or str(log))
            if len(logs) == 1 or error.where.file in (str(vehicle), str(channels)):
                raise
            results.append(to_error_document(error))
            failed = error
            if not as_json:
                show_error(error, as_json=False)
    if as_json:
        print_json(results[0] if len(results) == 1 else {"results": results})
    if failed is not None:
        raise typer.Exit(failed.exit_code)
    _exit_by_status([one["status"] for one in results], strict)


def _exit_by_status(statuses: Sequence[str], strict: bool) -> None:
    """Exit with `NOT_CONFIRMED` if a model is not confirmed by its log and `strict` is set."""
    if strict and not all(ModelStatus(one).is_confirmed for one in statuses):
        raise typer.Exit(NOT_CONFIRMED)


def _identify_log(log: Path, how: Request, folder: Path | None, as_json: bool) -> dict[str, Any]:
    """Identify a log, write and print the result."""
    from drivetwin.cli.identify_run import run_identification, write_outcome

    outcome = run_identification(log, how)
    files = () if folder is None else write_outcome(outcome, folder)
    if not as_json:
        _print_result(outcome.found, {log.name: outcome.found.shifts})
        for file in files:
            print_line(f"wrote {file}")
    return _to_document(outcome.found, files)


def _identify_joint(
    logs: list[Path],
    how: Request,
    hold_out: list[str],
    output: Path | None,
    as_json: bool,
) -> ModelStatus:
    """Fit all logs as one and predict the held-out shifts; return the status of the model."""
    from drivetwin.cli.identify_joint import identify_logs, print_joint, write_joint

    outcome = identify_logs(logs, how, hold_out)
    files = write_joint(outcome, output) if output is not None else ()
    if as_json:
        print_json(_to_document(outcome.found, files))
        return outcome.found.status
    _print_result(outcome.found, outcome.shifts)
    print_joint(outcome.found)
    for file in files:
        print_line(f"wrote {file}")
    return outcome.found.status


def _choose_folders(logs: list[Path], output: Path | None) -> dict[Path, Path]:
    """Output folder of each log; empty where nothing is to be written."""
    if output is None:
        return {}
    if len(logs) == 1:
        return {logs[0]: output}
    refuse_same_names(logs, "identify them in separate runs with different -o")
    return {log: output / log.stem for log in logs}


def _to_document(found: Identification, files: tuple[Path, ...]) -> dict[str, Any]:
    """The content of result.json, with the files that were written."""
    import json

    from drivetwin.files.result_file import ResultFile

    document: dict[str, Any] = json.loads(ResultFile.from_result(found).to_json())
    return {**document, "files": [str(file) for file in files]}


def _print_result(found: Identification, shifts: Mapping[str, Sequence[Shift]]) -> None:
    from drivetwin.cli.tables import (
        build_fit_table,
        build_friction_table,
        build_parameter_table,
        build_shift_table,
        build_suggestion_table,
        list_limits,
        list_remarks,
    )
    from drivetwin.report.model_verdict import explain_identification

    print_verdict(explain_identification(found))
    for source, own in shifts.items():
        print_table(build_shift_table(own, source))
    print_table(build_parameter_table(found.estimates, f"Parameters ({found.method} method)"))
    for line in (lines := list_remarks(found.estimates)):
        print_paragraph(line)
    if lines:
        print_line("")
    if found.friction:
        print_table(build_friction_table(found.friction))
    suggestions = found.evidence.suggestions
    if any(one.best is not None for one in suggestions):
        print_table(build_suggestion_table(suggestions, found.estimates))
    for line in (limits := list_limits(suggestions)):
        print_paragraph(line)
    if limits:
        print_line("")
    if found.fit:
        print_table(build_fit_table(found.fit, "Simulation over measurement"))
    print_findings(found.findings)
