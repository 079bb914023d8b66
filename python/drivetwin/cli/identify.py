# SPDX-License-Identifier: MIT
"""`drivetwin identify LOG...`: parameters with intervals and verdicts, twin and report."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from drivetwin._util.progress import TimedStages, scale_progress
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.cli.input_files import find_logs, find_mapping
from drivetwin.cli.options import (
    REPORT,
    RESULT,
    TWIN,
)
from drivetwin.cli.output import (
    refuse_same_names,
    show_findings,
    show_step,
    write_atomically,
)
from drivetwin.cli.requests.identification import Identify, IdentifyOptions
from drivetwin.errors import DrivetwinError, InputError, Where
from drivetwin.estimation.analysis.experiment_design import rank_for_weak
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.mechanism import quick
from drivetwin.estimation.result.method import Method
from drivetwin.files.result_file import ResultFile, save_result
from drivetwin.files.twin_file import save_twin
from drivetwin.findings import Finding
from drivetwin.logs.read import read_log
from drivetwin.plausibility.check import check_card
from drivetwin.report.blocks import Outcome
from drivetwin.report.html import build_identification_blocks, build_report_page, save_page
from drivetwin.shifts.detect import FoundShifts, detect_shifts, refuse_without_shifts
from drivetwin.tcu.card import is_controller_card
from drivetwin.validation.validated_model import (
    JointIdentification,
    Source,
    identify_together,
)
from drivetwin.vehicle.card import VehicleCard, is_ratio_card, load_card
from drivetwin.vehicle.effects import parse_priors

_READING = TimedStages("reading", ("log", "shifts", "card"))


def load_identified_card(how: IdentifyOptions) -> VehicleCard:
    """Read the card of an identification with the priors of effects."""
    card = load_card(how.vehicle)
    return replace(card, effects={**card.effects, **parse_priors(how.effects)})


def read_shifts(
    path: Path, how: IdentifyOptions, card: VehicleCard
) -> tuple[ShiftLog, FoundShifts, tuple[Finding, ...]]:
    """Read a log and detect its shifts; the findings compare it with the card.

    Raises the typed errors of the readers and of the detection.
    """
    with _READING.enter("log"):
        log = read_log(path, card, find_mapping(how.channels, path))
    with _READING.enter("shifts", "looking for shifts"):
        shifts = detect_shifts(log, card)
    with _READING.enter("card", "checking the card"):
        return log, shifts, tuple(check_card(card, log, shifts.shifts))


def run_identification(
    logs: Sequence[Path], how: IdentifyOptions, wanted: Sequence[str] = ()
) -> JointIdentification:
    """Read logs, fit what is not `wanted` for prediction together, validate and predict.

    Raises the typed errors of each stage; NoShiftError lists what was refused and why.
    """
    refuse_same_names(logs, "rename one of them")
    card = load_identified_card(how)
    with show_step(f"reading {logs[0].name if len(logs) == 1 else f'{len(logs)} logs'}"):
        reads = []
        for number, path in enumerate(logs):
            with scale_progress(number / len(logs), (number + 1) / len(logs)):
                reads.append(read_shifts(path, how, card))
    show_findings(dict.fromkeys(one for _, _, doubts in reads for one in doubts))
    for log, each, _ in reads:
        if not each.shifts:
            show_findings(log.findings)  # A saturated speed holds no gear.
        refuse_without_shifts(log, card, each)
    held = parse_holdouts(wanted, logs, [each for _, each, _ in reads])
    sources = [Source(log, each, part) for (log, each, _), part in zip(reads, held, strict=True)]
    with show_step(f"identifying by the {how.method} method"), quick(how.quick):
        made = identify_together(sources, card, how.method)
    if how.method is Method.PAPER:
        return made
    with show_step("comparing experiments"):
        return replace(made, found=rank_for_weak(made.found))


def build_outcome(found: Identification, files: Sequence[Path]) -> Outcome:
    """Build the outcome of an identification with the files that were written."""
    document = ResultFile.from_result(found).to_document()
    return Outcome(build_identification_blocks(found), document, files, found.status.is_confirmed)


def write_outcome(made: JointIdentification, folder: Path) -> tuple[Path, ...]:
    """Write result, report and twins into `folder`, all or none; return their paths.

    `twin.toml` is that of the first log; of several each has `NAME-OF-LOG.twin.toml` besides.
    """
    twins = list(made.twins.items())
    named = {TWIN: twins[0][1]}
    if len(twins) > 1:
        named |= {f"{Path(source).stem}.{TWIN}": twin for source, twin in twins}
    with show_step("writing the report"), write_atomically(folder) as beside:
        save_result(beside / RESULT, made.found)
        for name, twin in named.items():
            save_twin(beside / name, twin)
        save_page(beside / REPORT, build_report_page(made.found, made.fitted))
    return tuple(folder / name for name in (RESULT, *named, REPORT))


def identify(request: Identify) -> Iterator[Outcome]:
    """Identify logs one by one or jointly, or all logs of a bus or of a gearbox control."""
    logs = request.logs
    is_controller = request.vehicle is not None and is_controller_card(request.vehicle)
    if is_controller or _is_bus(request):
        # A log of shifts does not wait for the import of other estimators.
        from drivetwin.cli.identify_whole_logs import identify_bus_logs, identify_controller_logs

        yield (identify_controller_logs if is_controller else identify_bus_logs)(request)
        return
    together = request.together or request.hold_out or len(logs) == 1
    for group in [logs] if together else _divide(logs, request.output):
        folder = request.output and (request.output if together else request.output / group[0].stem)
        try:
            made = run_identification(group, request.options, request.hold_out)
            yield build_outcome(made.found, () if folder is None else write_outcome(made, folder))
        except DrivetwinError as error:
            if len(group) == 1:
                error.where = replace(error.where, file=error.where.file or str(group[0]))
            if together or error.where.file in (str(request.vehicle), str(request.channels)):
                raise
            yield Outcome(fault=error)


def _is_bus(request: Identify) -> bool:
    """Return True if speeds, gear and engine torque alone are to be used."""
    return request.bus or request.vehicle is None or is_ratio_card(request.vehicle)


def _divide(logs: Sequence[Path], output: Path | None) -> list[Sequence[Path]]:
    """Return the logs one by one; raises InputError where their results would share a folder."""
    if output is not None:
        refuse_same_names(logs, "identify them in separate runs with different -o")
    return [[log] for log in logs]


def parse_holdouts(
    wanted: Sequence[str], logs: Sequence[Path], shifts: Sequence[FoundShifts]
) -> list[frozenset[int]]:
    """Numbers of the shifts to predict, log by log, counted from 1.

    `N` is a shift of the only log, `FILE` all shifts of a log, `FILE:N` one of them; a file may be
    named with or without folder and ending. Raises InputError for what is none of these.
    """
    held: list[set[int]] = [set() for _ in logs]
    for text in wanted:
        place, number = _parse_shift(text, logs)
        every = range(1, len(shifts[place].shifts) + 1)
        held[place] |= set(every) if number is None else {number}
    return [frozenset(one) for one in held]


def _parse_shift(text: str, logs: Sequence[Path]) -> tuple[int, int | None]:
    """Place of the log, and number of the shift; None for all of them."""
    whole = find_logs(text, logs)
    if len(whole) == 1:
        return whole[0], None
    name, _, number = text.rpartition(":")
    places = find_logs(name, logs) if name else list(range(len(logs)))
    if not re.fullmatch(r"\d{1,9}", number) or len(places) != 1:
        raise InputError(
            f"{text!r} names no shift or log of {', '.join(log.name for log in logs)}",
            "give the number of a shift of the only log, a log, or LOG:NUMBER",
            Where(key="--hold-out"),
        )
    return places[0], int(number)
