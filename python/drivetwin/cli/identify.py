# SPDX-License-Identifier: MIT
"""`drivetwin identify LOG...`: parameters with intervals and verdicts, twin and report."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from drivetwin._util.request import FileRole, Request, flag, input_file, option, output_folder
from drivetwin.cli.arguments import logs_argument, mapping_option, method_option, quick_option
from drivetwin.cli.atomic_outputs import refuse_same_names
from drivetwin.cli.identify_run import IdentifyOptions, effects_option
from drivetwin.cli.output import print_blocks, print_json, print_line, show_error, to_error_document
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.result.method import Method, ModelStatus

if TYPE_CHECKING:
    from drivetwin.estimation.identification import Identification


NOT_CONFIRMED = 3
"""Exit code of a model that is neither valid nor valid with limits, with --strict."""


class Identify(Request, command="identify"):
    """Arguments of `identify`."""

    logs: tuple[Path, ...] = logs_argument("One or more shift logs.")
    vehicle: Path | None = input_file(
        "Vehicle card, or a card of the ratios alone (TOML); without one, the ratios are taken "
        "from the speeds of a bus log.",
        "CARD",
        FileRole.CARD,
    )
    channels: Path | None = mapping_option()
    method: Method = method_option()
    quick: bool = quick_option()
    effects: tuple[str, ...] = effects_option()
    output: Path | None = output_folder("Folder for result, twin and report.")
    together: bool = flag("Fit all logs of one vehicle jointly.")
    hold_out: tuple[str, ...] = option(
        "Shift to predict instead of fit: its number, a LOG, or LOG:NUMBER; repeatable.",
        metavar="SHIFT",
        default=(),
    )
    bus: bool = flag("Use speeds, gear and engine torque alone, also with a whole vehicle card.")
    strict: bool = flag("Exit with code 3 unless every model is valid, limits included.")

    @property
    def options(self) -> IdentifyOptions:
        """The options of the identification of a whole vehicle card."""
        return IdentifyOptions(**self.select(IdentifyOptions))


def identify(request: Identify, *, as_json: bool) -> None:
    """Identify the driveline from shift logs.

    With -o, write DIR/result.json, DIR/twin.toml and DIR/report.html. Several logs are identified
    one by one, each into DIR/NAME-OF-LOG. If a log cannot be identified, it is reported and the
    exit code is 2; the other logs get their results.

    With --together, one driveline is fitted to all logs; load and engine-torque delay are specific
    to each log. With --hold-out, which implies --together, a log or shift takes no part in the fit.
    It is simulated with the parameters of the others and compared.

    Bus logs without pressures and output torque need a card of the ratios alone, or none: all logs
    are then of one vehicle and identified as one, into DIR/bus.json and DIR/report.html. With
    --hold-out, the decays of a LOG are predicted by the others.
    """
    if _is_bus(request):
        _identify_bus(request, as_json)
        return
    if request.together or request.hold_out:
        _exit_by_status([_identify_joint(request, as_json)], request.strict)
        return
    logs = request.logs
    folders = _choose_folders(logs, request.output)
    results: list[dict[str, Any]] = []
    failed: DrivetwinError | None = None
    for log in logs:
        try:
            results.append(_identify_log(log, request.options, folders.get(log), as_json))
        except DrivetwinError as error:
            error.where = replace(error.where, file=error.where.file or str(log))
            if len(logs) == 1 or error.where.file in (str(request.vehicle), str(request.channels)):
                raise
            results.append(to_error_document(error))
            failed = error
            if not as_json:
                show_error(error, as_json=False)
    if as_json:
        print_json(results[0] if len(results) == 1 else {"results": results})
    if failed is not None:
        raise typer.Exit(failed.exit_code)
    _exit_by_status([one["status"] for one in results], request.strict)


def _is_bus(request: Identify) -> bool:
    """Return True if speeds, gear and engine torque alone are to be used."""
    from drivetwin.vehicle.ratio_card import is_ratio_card

    return request.bus or request.vehicle is None or is_ratio_card(request.vehicle)


def _identify_bus(request: Identify, as_json: bool) -> None:
    """Identify bus logs of one vehicle, write and print the result."""
    from drivetwin.cli.identify_bus import identify_bus_logs, write_bus

    outcome = identify_bus_logs(
        request.logs, request.vehicle, request.channels, request.hold_out, request.strict
    )
    settings = request.describe_settings()
    files = () if request.output is None else write_bus(outcome, request.output, settings)
    if as_json:
        document = outcome.build_file(settings).model_dump(mode="json", by_alias=True)
        print_json({**document, "files": [str(file) for file in files]})
        return
    print_blocks(outcome.build_blocks())
    for file in files:
        print_line(f"wrote {file}")


def _exit_by_status(statuses: Sequence[str], strict: bool) -> None:
    """Exit with `NOT_CONFIRMED` if a model is not confirmed by its log and `strict` is set."""
    if strict and not all(ModelStatus(one).is_confirmed for one in statuses):
        raise typer.Exit(NOT_CONFIRMED)


def _identify_log(
    log: Path, how: IdentifyOptions, folder: Path | None, as_json: bool
) -> dict[str, Any]:
    """Identify a log, write and print the result."""
    from drivetwin.cli.identify_run import run_identification, write_outcome

    outcome = run_identification(log, how)
    files = () if folder is None else write_outcome(outcome, folder)
    if not as_json:
        _print_result(outcome.found, files)
    return _to_document(outcome.found, files)


def _identify_joint(request: Identify, as_json: bool) -> ModelStatus:
    """Fit all logs as one and predict the held-out shifts; return the status of the model."""
    from drivetwin.cli.identify_joint import identify_logs, write_joint

    outcome = identify_logs(request.logs, request.options, request.hold_out)
    files = () if request.output is None else write_joint(outcome, request.output)
    if as_json:
        print_json(_to_document(outcome.found, files))
        return outcome.found.status
    _print_result(outcome.found, files)
    return outcome.found.status


def _choose_folders(logs: Sequence[Path], output: Path | None) -> dict[Path, Path]:
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


def _print_result(found: Identification, files: Sequence[Path]) -> None:
    from drivetwin.report.brief import build_identification_blocks

    print_blocks(build_identification_blocks(found))
    for file in files:
        print_line(f"wrote {file}")
