# SPDX-License-Identifier: MIT
"""`drivetwin identify --together` and `--hold-out`: one driveline from several logs or shifts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin.cli.atomic_outputs import refuse_alike, staged
from drivetwin.cli.holdout_args import held_numbers
from drivetwin.cli.identify_run import REPORT, RESULT, TWIN
from drivetwin.cli.numbers import percent, quantity
from drivetwin.cli.output import note, say, show, step, table_of
from drivetwin.report.labels import channel_unit

if TYPE_CHECKING:
    from rich.table import Table

    from drivetwin.channels.shiftlog import ShiftLog
    from drivetwin.estimation.identification import Identification
    from drivetwin.estimation.result.method import Method
    from drivetwin.estimation.result.multi_log import Several
    from drivetwin.estimation.result.validation import HeldOut
    from drivetwin.shifts.shift import Shift
    from drivetwin.validation.multi_log import Together


@dataclass(frozen=True, eq=False)
class Joined:
    """Result of a joint identification: fitted and held-out logs, and the identification."""

    logs: tuple[ShiftLog, ...]
    made: Together

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


def run(
    logs: Sequence[Path],
    vehicle: Path,
    channels: Path | None,
    method: Method,
    wanted: Sequence[str],
) -> Joined:
    """Read all logs, fit what is not held out together, predict the rest.

    Raises the typed errors of each stage.
    """
    from drivetwin.estimation.analysis.experiment_design import examined
    from drivetwin.logs.read import read_log
    from drivetwin.shifts.detect import usable_shifts
    from drivetwin.validation.multi_log import Source, identify_together
    from drivetwin.vehicle.card import load_card

    refuse_alike(logs, "rename one of them")
    card = load_card(vehicle)
    with step(f"reading {len(logs)} logs"):
        read = tuple(read_log(log, card, channels) for log in logs)
        shifts = [usable_shifts(log, card) for log in read]
    held = held_numbers(wanted, logs, shifts)
    sources = [
        Source(log, found, each) for log, found, each in zip(read, shifts, held, strict=True)
    ]
    with step(f"identifying by the {method} method"):
        made = identify_together(sources, card, method)
    with step("comparing experiments"):
        found = examined(made.found)
    return Joined(read, replace(made, found=found))


def write(outcome: Joined, folder: Path) -> tuple[Path, ...]:
    """Write result, report and twins into `folder`, all or none; returns their paths.

    `twin.toml` is that of the first log; of several each has `NAME-OF-LOG.twin.toml` besides.
    """
    from drivetwin.files.result_file import save_result
    from drivetwin.files.twin_conversion import save_twin
    from drivetwin.report.together import save_together

    twins = list(outcome.made.twins.items())
    named = {TWIN: twins[0][1]}
    if len(twins) > 1:
        named |= {f"{Path(source).stem}.{TWIN}": twin for source, twin in twins}
    with step("writing the report"), staged(folder) as beside:
        save_result(beside / RESULT, outcome.found)
        for name, twin in named.items():
            save_twin(beside / name, twin)
        save_together(beside / REPORT, outcome.found, outcome.made.fitted)
    return tuple(folder / name for name in (RESULT, *named, REPORT))


def print_together(found: Identification) -> None:
    """Print the joint estimates and the prediction of the held-out shifts."""
    several = found.evidence.several
    if several is not None:
        show(_log_table(several))
        note(several.consistency.text)
        say("")
    held = found.evidence.held_out
    if held:
        show(_held_table(held, found))
    for one in held:
        for text in one.notes:
            note(f"{one.name}: {text}")


def _log_table(several: Several) -> Table:
    """Each log with its number, as in parameter ids, and the fit of the common model."""
    table = table_of("Logs fitted together", "log", "file", "shifts", "fit %", right=("fit %",))
    for one in several.logs:
        shifts = ", ".join(f"{shift.start_gear}→{shift.end_gear}" for shift in one.shifts)
        fit = one.fit.get("output_torque", {}).get("all")
        shown = percent(None if fit is None else fit.fit_percent)
        table.add_row(str(one.number), Path(one.source).name, shifts, shown)
    return table


def _held_table(held: Sequence[HeldOut], found: Identification) -> Table:
    """Tabulate the fit in % of predictions, of the fitted shifts, and of the noise limit."""
    table = table_of(
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
            unit = channel_unit(signal)
            table.add_row(
                one.name if place == 0 else "",
                signal.replace("_", " "),
                percent(phases["all"].fit_percent),
                percent(None if fitted is None else fitted.fit_percent),
                quantity(phases["all"].rmse, unit),
                "" if bound is None else quantity(bound.largest, unit),
                one.outcome_of(signal).value,
            )
    return table
