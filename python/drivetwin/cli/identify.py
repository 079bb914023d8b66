# SPDX-License-Identifier: MIT
"""`drivetwin identify LOG...`: parameters with intervals and verdicts, twin and report."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from drivetwin._util.request import FileRole, Request, flag, input_file, option, output_folder
from drivetwin.cli.arguments import (
    logs_argument,
    mapping_option,
    method_option,
    quick_option,
    strict_flag,
)
from drivetwin.cli.atomic_outputs import refuse_same_names
from drivetwin.cli.identify_run import IdentifyOptions, effects_option
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.result.method import Method
from drivetwin.report.outcome import Outcome


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
    strict: bool = strict_flag(
        "every model is valid, limits included; of bus logs, unless the shifts agree and identify "
        "a quantity"
    )

    @property
    def options(self) -> IdentifyOptions:
        """The options of the identification of a whole vehicle card."""
        return IdentifyOptions(**self.select(IdentifyOptions))


def identify(request: Identify) -> Iterator[Outcome]:
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
    from drivetwin.cli.identify_bus import identify_bus_logs
    from drivetwin.cli.identify_joint import identify_jointly
    from drivetwin.cli.identify_run import identify_log

    logs, how = request.logs, request.options
    if _is_bus(request):
        yield identify_bus_logs(request)
        return
    if request.together or request.hold_out:
        yield identify_jointly(logs, how, request.hold_out, request.output)
        return
    folders = _choose_folders(logs, request.output)
    for log in logs:
        try:
            yield identify_log(log, how, folders.get(log))
        except DrivetwinError as error:
            error.where = replace(error.where, file=error.where.file or str(log))
            if len(logs) == 1 or error.where.file in (str(request.vehicle), str(request.channels)):
                raise
            yield Outcome(fault=error)


def _is_bus(request: Identify) -> bool:
    """Return True if speeds, gear and engine torque alone are to be used."""
    from drivetwin.vehicle.ratio_card import is_ratio_card

    return request.bus or request.vehicle is None or is_ratio_card(request.vehicle)


def _choose_folders(logs: Sequence[Path], output: Path | None) -> dict[Path, Path]:
    """Output folder of each log; empty where nothing is to be written."""
    if output is None:
        return {}
    if len(logs) == 1:
        return {logs[0]: output}
    refuse_same_names(logs, "identify them in separate runs with different -o")
    return {log: output / log.stem for log in logs}
