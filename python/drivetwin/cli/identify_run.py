# SPDX-License-Identifier: MIT
"""Request of `drivetwin identify`; from a log and a card to an identification and its files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from drivetwin._util.progress import TimedStages
from drivetwin._util.request import FileRole, Request, flag, input_file, option, output_folder
from drivetwin.cli.arguments import (
    REPORT,
    RESULT,
    TWIN,
    CardInput,
    find_mapping,
    logs_argument,
    mapping_option,
    method_option,
    quick_option,
    strict_flag,
)
from drivetwin.cli.output import show_findings, show_step, write_atomically
from drivetwin.estimation.likelihood.mechanism import quick
from drivetwin.estimation.result.method import Method
from drivetwin.report.blocks import Outcome
from drivetwin.vehicle.effects import parse_priors

if TYPE_CHECKING:
    from drivetwin.channels.shiftlog import ShiftLog
    from drivetwin.estimation.identification import Identification
    from drivetwin.findings import Finding
    from drivetwin.shifts.detect import FoundShifts
    from drivetwin.twin.twin import Twin
    from drivetwin.vehicle.card import VehicleCard

_READING = TimedStages("reading", ("log", "shifts", "card"))


def effects_option() -> Any:
    """Declare the priors of effects."""
    return option(
        "Prior of an effect that the model omits, such as tyre_slip=0.002; 0: no effect.",
        "--effect",
        metavar="NAME=STD",
        default=(),
    )


class IdentifyOptions(CardInput):
    """Card, channel mapping and method of an identification, and priors of effects as typed."""

    method: Method = method_option()
    quick: bool = quick_option()
    effects: tuple[str, ...] = effects_option()

    def load_card(self) -> VehicleCard:
        """Read the card with the priors of effects."""
        from drivetwin.vehicle.card import load_card

        card = load_card(self.vehicle)
        return replace(card, effects={**card.effects, **parse_priors(self.effects)})


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


@dataclass(frozen=True, eq=False)
class IdentifiedLog:
    """Result of one log: the log, its card, the identification and the twin."""

    log: ShiftLog
    card: VehicleCard
    found: Identification
    twin: Twin


def read_shifts(
    path: Path, how: IdentifyOptions, card: VehicleCard
) -> tuple[ShiftLog, FoundShifts, tuple[Finding, ...]]:
    """Read a log and detect its shifts; the findings compare it with the card.

    Raises the typed errors of the readers and of the detection.
    """
    from drivetwin.logs.read import read_log
    from drivetwin.plausibility.check import check_card
    from drivetwin.shifts.detect import detect_shifts

    with _READING.enter("log"):
        log = read_log(path, card, find_mapping(how.channels, path))
    with _READING.enter("shifts", "looking for shifts"):
        shifts = detect_shifts(log, card)
    with _READING.enter("card", "checking the card"):
        return log, shifts, tuple(check_card(card, log, shifts.shifts))


def run_identification(log: Path, how: IdentifyOptions) -> IdentifiedLog:
    """Read, find shifts, identify, and validate by simulation.

    Raises the typed errors of each stage; NoShiftError lists what was refused and why.
    """
    from drivetwin.estimation.result.method import Method
    from drivetwin.shifts.detect import refuse_without_shifts
    from drivetwin.validation.validated_model import identify_validated

    with show_step(f"reading {log.name}"):
        card = how.load_card()
        recording, shifts, doubts = read_shifts(log, how, card)
    show_findings(doubts)
    refuse_without_shifts(recording, card, shifts)
    with show_step(f"identifying by the {how.method} method"), quick(how.quick):
        model = identify_validated(recording, card, shifts, how.method)
    found = model.result
    if found.method is Method.LIKELIHOOD:
        from drivetwin.estimation.analysis.experiment_design import rank_for_weak

        with show_step("comparing experiments"):
            found = rank_for_weak(found)
    return IdentifiedLog(recording, card, found, model.twin)


def identify_log(log: Path, how: IdentifyOptions, folder: Path | None) -> Outcome:
    """Identify a log, and write the result if a folder is given."""
    made = run_identification(log, how)
    return build_outcome(made.found, () if folder is None else write_outcome(made, folder))


def build_outcome(found: Identification, files: Sequence[Path]) -> Outcome:
    """Build the outcome of an identification with the files that were written."""
    from drivetwin.files.result_file import ResultFile
    from drivetwin.report.notebook import build_identification_blocks

    document = ResultFile.from_result(found).to_document()
    return Outcome(build_identification_blocks(found), document, files, found.status.is_confirmed)


def write_outcome(outcome: IdentifiedLog, folder: Path) -> tuple[Path, ...]:
    """Write result, twin and report into `folder`, all or none; returns their paths."""
    from drivetwin.files.result_file import save_result
    from drivetwin.files.twin_file import save_twin
    from drivetwin.report.html import save_report

    with show_step("writing the report"), write_atomically(folder) as beside:
        save_result(beside / RESULT, outcome.found)
        save_twin(beside / TWIN, outcome.twin)
        save_report(beside / REPORT, outcome.found, outcome.log)
    return tuple(folder / name for name in (RESULT, TWIN, REPORT))
