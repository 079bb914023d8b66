# SPDX-License-Identifier: MIT
"""`drivetwin identify --together` and `--hold-out`: one driveline from several logs or shifts."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin._util.progress import scale_progress
from drivetwin.cli.arguments import REPORT, RESULT, TWIN
from drivetwin.cli.atomic_outputs import refuse_same_names, write_atomically
from drivetwin.cli.identify_run import IdentifyOptions, read_shifts
from drivetwin.cli.numbers import format_percent, format_quantity
from drivetwin.cli.output import (
    make_table,
    print_line,
    print_paragraph,
    print_table,
    show_findings,
    show_step,
)
from drivetwin.errors import InputError, Where
from drivetwin.report.labels import get_channel_unit

if TYPE_CHECKING:
    from rich.table import Table

    from drivetwin.channels.shiftlog import ShiftLog
    from drivetwin.estimation.identification import Identification
    from drivetwin.estimation.result.multi_log import Several
    from drivetwin.estimation.result.validation import HeldOut
    from drivetwin.shifts.detect import FoundShifts
    from drivetwin.shifts.shift import Shift
    from drivetwin.validation.multi_log import JointIdentification


@dataclass(frozen=True, eq=False)
class Joined:
    """Result of a joint identification: fitted and held-out logs, and the identification."""

    logs: tuple[ShiftLog, ...]
    made: JointIdentification

    @property
    def found(self) -> Identification:
        """The identification."""
        return self.made.found

    @property
    def shifts(self) -> dict[str, tuple[Shift, ...]]:
        """The shifts that were fitted, by name of their log."""
        several = self.found.evidence.several
        if several is None:
            return {Path(self.made.fitted[0].source).name: self.found.shifts}
        return {Path(one.source).name: one.shifts for one in several.logs}


def identify_logs(
    logs: Sequence[Path],
    how: IdentifyOptions,
    wanted: Sequence[str],
) -> Joined:
    """Read all logs, fit what is not held out together, predict the rest.

    Raises the typed errors of each stage.
    """
    from drivetwin.estimation.analysis.experiment_design import rank_experiments
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
        refuse_without_shifts(log, each)
    read, shifts = [log for log, _, _ in reads], [each for _, each, _ in reads]
    held = parse_holdouts(wanted, logs, shifts)
    sources = [
        Source(log, found, each) for log, found, each in zip(read, shifts, held, strict=True)
    ]
    with show_step(f"identifying by the {how.method} method"):
        made = identify_together(sources, card, how.method)
    with show_step("comparing experiments"):
        found = rank_experiments(made.found)
    return Joined(tuple(read), replace(made, found=found))


def write_joint(outcome: Joined, folder: Path) -> tuple[Path, ...]:
    """Write result, report and twins into `folder`, all or none; returns their paths.

    `twin.toml` is that of the first log; of several each has `NAME-OF-LOG.twin.toml` besides.
    """
    from drivetwin.files.result_file import save_result
    from drivetwin.files.twin_file import save_twin
    from drivetwin.report.together import save_joint_report

    twins = list(outcome.made.twins.items())
    named = {TWIN: twins[0][1]}
    if len(twins) > 1:
        named |= {f"{Path(source).stem}.{TWIN}": twin for source, twin in twins}
    with show_step("writing the report"), write_atomically(folder) as beside:
        save_result(beside / RESULT, outcome.found)
        for name, twin in named.items():
            save_twin(beside / name, twin)
        save_joint_report(beside / REPORT, outcome.found, outcome.made.fitted)
    return tuple(folder / name for name in (RESULT, *named, REPORT))


def print_joint(found: Identification) -> None:
    """Print the joint estimates and the prediction of the held-out shifts."""
    several = found.evidence.several
    if several is not None:
        print_table(_build_log_table(several))
        print_paragraph(several.consistency.text)
        print_line("")
    held = found.evidence.held_out
    if held:
        print_table(_build_holdout_table(held, found))
    for one in held:
        for finding in one.findings:
            print_paragraph(f"{one.name}: {finding.text}")


def _build_log_table(several: Several) -> Table:
    """Each log with its number, as in parameter ids, and the fit of the common model."""
    table = make_table("Logs fitted together", "log", "file", "shifts", "fit %", right=("fit %",))
    for one in several.logs:
        shifts = ", ".join(f"{shift.start_gear}→{shift.end_gear}" for shift in one.shifts)
        fit = one.fit.get("output_torque", {}).get("all")
        shown = format_percent(None if fit is None else fit.fit_percent)
        table.add_row(str(one.number), Path(one.source).name, shifts, shown)
    return table


def _build_holdout_table(held: Sequence[HeldOut], found: Identification) -> Table:
    """Tabulate the fit in % of predictions, of the fitted shifts, and of the noise limit."""
    table = make_table(
        "Held out: predicted, not fitted",
        "shift", "signal", "fit %", "fitted %", "rmse", "allowed", "verdict",
        right=("fit %", "fitted %", "rmse", "allowed"),
    )  # fmt: skip
    for one in held:
        if one.validation is None:
            table.add_row(one.name, "", "", "", "", "", one.outcome.value)
            continue
        for place, (signal, phases) in enumerate(one.validation.fit.items()):
            fitted = found.fit.get(signal, {}).get("all")
            bound = one.bounds.get(signal)
            unit = get_channel_unit(signal)
            table.add_row(
                one.name if place == 0 else "",
                signal.replace("_", " "),
                format_percent(phases["all"].fit_percent),
                format_percent(None if fitted is None else fitted.fit_percent),
                format_quantity(phases["all"].rmse, unit),
                "" if bound is None else format_quantity(bound.largest, unit),
                one.get_signal_outcome(signal).value,
            )
    return table


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
