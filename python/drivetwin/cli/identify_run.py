# SPDX-License-Identifier: MIT
"""From a log and a card to an identification with its twin, validation and files."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from drivetwin.cli.arguments import REPORT, RESULT, TWIN, find_mapping
from drivetwin.cli.atomic_outputs import write_atomically
from drivetwin.cli.output import show_findings, show_step
from drivetwin.estimation.result.method import Method
from drivetwin.vehicle.effects import parse_priors

if TYPE_CHECKING:
    from drivetwin.channels.shiftlog import ShiftLog
    from drivetwin.estimation.identification import Identification
    from drivetwin.twin.twin import Twin
    from drivetwin.vehicle.card import VehicleCard


@dataclass(frozen=True)
class Request:
    """Card, channel mapping and method of an identification, and priors of effects as typed."""

    vehicle: Path
    channels: Path | None
    method: Method
    effects: tuple[str, ...] = ()

    def load(self, log: Path) -> tuple[ShiftLog, VehicleCard]:
        """Read a log and the card with these priors."""
        from drivetwin.logs.read import read_log

        card = self.load_card()
        return read_log(log, card, find_mapping(self.channels, log)), card

    def load_card(self) -> VehicleCard:
        """Read the card with the priors of effects."""
        from drivetwin.vehicle.card import load_card

        card = load_card(self.vehicle)
        return replace(card, effects={**card.effects, **parse_priors(self.effects)})


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of one log: the log, its card, the identification and the twin."""

    log: ShiftLog
    card: VehicleCard
    found: Identification
    twin: Twin


def run_identification(log: Path, how: Request) -> Outcome:
    """Read, find shifts, identify, and validate by simulation.

    Raises the typed errors of each stage; NoShiftError lists what was refused and why.
    """
    from drivetwin.estimation.result.method import Method
    from drivetwin.plausibility.check import check_card
    from drivetwin.shifts.detect import detect_shifts, refuse_without_shifts
    from drivetwin.validation.validated_model import identify_validated

    with show_step(f"reading {log.name}"):
        recording, card = how.load(log)
        shifts = detect_shifts(recording, card)
        doubts = check_card(card, recording, shifts.shifts)
    show_findings(doubts)
    refuse_without_shifts(recording, shifts)
    with show_step(f"identifying by the {how.method} method"):
        model = identify_validated(recording, card, shifts, how.method)
    found = model.result
    if found.method is Method.LIKELIHOOD:
        from drivetwin.estimation.analysis.experiment_design import rank_experiments

        with show_step("comparing experiments"):
            found = rank_experiments(found)
    return Outcome(recording, card, found, model.twin)


def write_outcome(outcome: Outcome, folder: Path) -> tuple[Path, ...]:
    """Write result, twin and report into `folder`, all or none; returns their paths."""
    from drivetwin.files.result_file import save_result
    from drivetwin.files.twin_conversion import save_twin
    from drivetwin.report.html import save_report

    with show_step("writing the report"), write_atomically(folder) as beside:
        save_result(beside / RESULT, outcome.found)
        save_twin(beside / TWIN, outcome.twin)
        save_report(beside / REPORT, outcome.found, outcome.log)
    return tuple(folder / name for name in (RESULT, TWIN, REPORT))
