# SPDX-License-Identifier: MIT
"""`drivetwin identify --together` and `--hold-out`: one driveline from several logs or shifts."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin._util.progress import scale_progress
from drivetwin.cli.arguments import REPORT, RESULT, TWIN
from drivetwin.cli.atomic_outputs import refuse_same_names, write_atomically
from drivetwin.cli.identify_run import IdentifyOptions, build_outcome, read_shifts
from drivetwin.cli.output import show_findings, show_step
from drivetwin.errors import InputError, Where
from drivetwin.estimation.likelihood.mechanism import quick
from drivetwin.report.outcome import Outcome

if TYPE_CHECKING:
    from drivetwin.shifts.detect import FoundShifts
    from drivetwin.validation.multi_log import JointIdentification


def identify_jointly(
    logs: Sequence[Path], how: IdentifyOptions, wanted: Sequence[str], folder: Path | None
) -> Outcome:
    """Read all logs, fit what is not held out together, predict the rest, and write the result.

    Raises the typed errors of each stage.
    """
    from drivetwin.estimation.analysis.experiment_design import rank_for_weak
    from drivetwin.shifts.detect import refuse_without_shifts
    from drivetwin.validation.multi_log import Source, identify_together

    refuse_same_names(logs, "rename one of them")
    card = how.load_card()
    with show_step(f"reading {len(logs)} logs"):
        reads = []
        for number, path in enumerate(logs):
            with scale_progress(number / len(logs), (number + 1) / len(logs)):
                reads.append(read_shifts(path, how, card))
    show_findings(dict.fromkeys(one for _, _, doubts in reads for one in doubts))
    for log, each, _ in reads:
        refuse_without_shifts(log, card, each)
    read, shifts = [log for log, _, _ in reads], [each for _, each, _ in reads]
    held = parse_holdouts(wanted, logs, shifts)
    sources = [
        Source(log, found, each) for log, found, each in zip(read, shifts, held, strict=True)
    ]
    with show_step(f"identifying by the {how.method} method"), quick(how.quick):
        made = identify_together(sources, card, how.method)
    with show_step("comparing experiments"):
        found = rank_for_weak(made.found)
    made = replace(made, found=found)
    return build_outcome(found, () if folder is None else _write_joint(made, folder))


def _write_joint(made: JointIdentification, folder: Path) -> tuple[Path, ...]:
    """Write result, report and twins into `folder`, all or none; returns their paths.

    `twin.toml` is that of the first log; of several each has `NAME-OF-LOG.twin.toml` besides.
    """
    from drivetwin.files.result_file import save_result
    from drivetwin.files.twin_file import save_twin
    from drivetwin.report.html import save_joint_report

    twins = list(made.twins.items())
    named = {TWIN: twins[0][1]}
    if len(twins) > 1:
        named |= {f"{Path(source).stem}.{TWIN}": twin for source, twin in twins}
    with show_step("writing the report"), write_atomically(folder) as beside:
        save_result(beside / RESULT, made.found)
        for name, twin in named.items():
            save_twin(beside / name, twin)
        save_joint_report(beside / REPORT, made.found, made.fitted)
    return tuple(folder / name for name in (RESULT, *named, REPORT))


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
    whole = _find_logs(text, logs)
    if len(whole) == 1:
        return whole[0], None
    name, _, number = text.rpartition(":")
    places = _find_logs(name, logs) if name else list(range(len(logs)))
    if not re.fullmatch(r"\d{1,9}", number) or len(places) != 1:
        raise InputError(
            f"{text!r} names no shift or log of {', '.join(log.name for log in logs)}",
            "give the number of a shift of the only log, a log, or LOG:NUMBER",
            Where(key="--hold-out"),
        )
    return places[0], int(number)


def _find_logs(name: str, logs: Sequence[Path]) -> list[int]:
    return [k for k, log in enumerate(logs) if name in (str(log), log.name, log.stem)]
