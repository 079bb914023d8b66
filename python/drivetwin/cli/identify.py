# SPDX-License-Identifier: MIT
"""`drivetwin identify LOG...`: parameters with intervals and verdicts, twin and report."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from drivetwin.cli.arguments import ChannelsFile, VehicleFile
from drivetwin.cli.output import JsonFlag, note, print_json, say, show
from drivetwin.errors import InputError, Where
from drivetwin.identify.method import DEFAULT_METHOD, Method

if TYPE_CHECKING:
    from drivetwin.cli.pipeline import Outcome


def identify(
    logs: Annotated[list[Path], typer.Argument(metavar="LOG...", help="One or more shift logs.")],
    vehicle: VehicleFile,
    channels: ChannelsFile = None,
    method: Annotated[
        Method, typer.Option(metavar="METHOD", help="paper, integral or likelihood.")
    ] = DEFAULT_METHOD,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Where result, twin and report go."),
    ] = None,
    as_json: JsonFlag = False,
) -> None:
    """Identify the driveline behind a shift log.

    With -o, DIR/result.json, DIR/twin.toml and DIR/report.html are written;
    several logs are identified one by one, each into DIR/NAME-OF-LOG.
    """
    from drivetwin.cli.pipeline import run, write

    folders = _folders(logs, output)
    outcomes = {log: run(log, vehicle, channels, method) for log in logs}
    files = {
        log: write(outcome, folders[log]) if folders else () for log, outcome in outcomes.items()
    }
    if as_json:
        results = [_document(outcomes[log], files[log]) for log in logs]
        print_json(results[0] if len(results) == 1 else {"results": results})
        return
    for log in logs:
        _print(outcomes[log], log.name)
        for file in files[log]:
            say(f"wrote {file}")


def _folders(logs: list[Path], output: Path | None) -> dict[Path, Path]:
    """Output folder of each log; empty where nothing is to be written."""
    if output is None:
        return {}
    if len(logs) == 1:
        return {logs[0]: output}
    twice = [stem for stem, count in Counter(log.stem for log in logs).items() if count > 1]
    if twice:
        raise InputError(
            f"several logs are called {', '.join(twice)}: their results would share one folder",
            "identify them in separate runs with different -o",
            Where(file=str(output)),
        )
    return {log: output / log.stem for log in logs}


def _document(outcome: Outcome, files: tuple[Path, ...]) -> dict[str, Any]:
    """The content of result.json, with the files that were written."""
    import json

    from drivetwin.results.result_file import ResultFile

    document: dict[str, Any] = json.loads(ResultFile.of(outcome.found).to_json())
    return {**document, "files": [str(file) for file in files]}


def _print(outcome: Outcome, source: str) -> None:
    from drivetwin.cli.tables import (
        fit_table,
        friction_table,
        parameter_table,
        remarks,
        shift_table,
    )

    found = outcome.found
    show(shift_table(found.shifts, source))
    show(parameter_table(found.estimates, f"Parameters ({found.method} method)"))
    for line in remarks(found.estimates):
        note(line)
    if found.friction:
        show(friction_table(found.friction))
    if found.fit:
        show(fit_table(found.fit, "Simulation over measurement"))
    for shift in found.shifts:
        for text in shift.warnings:
            note(f"{shift.start_gear}→{shift.end_gear}: {text}")
    for warning in found.warnings:
        note(f"warning: {warning}")
