# SPDX-License-Identifier: MIT
"""The comparison: several identifications, and logs that each of them simulates, on one page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from drivetwin._util.atomic import write_text
from drivetwin._util.progress import notify_progress
from drivetwin._util.version import get_program_version
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.result.validation import Validation
from drivetwin.report.find_reports import Candidate, Trial
from drivetwin.report.html import render_page
from drivetwin.report.sections.comparison import (
    build_agreement_section,
    build_friction_overlay_section,
    build_origin_section,
    build_trial_sections,
)
from drivetwin.shifts.shift import Shift
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import simulate_shift


def save_comparison(
    path: Path | str, candidates: Sequence[Candidate], trials: Sequence[Trial]
) -> None:
    """Write the comparison; the file appears whole or not at all."""
    write_text(path, render_comparison(candidates, trials))


def render_comparison(candidates: Sequence[Candidate], trials: Sequence[Trial]) -> str:
    """HTML text of the comparison; with one candidate it shows the logs alone."""
    several = len(candidates) > 1
    sections = [
        *([build_agreement_section(candidates)] if several else []),
        *build_trial_sections(candidates, trials),
        build_friction_overlay_section(candidates),
        build_origin_section(candidates),
    ]
    names = ", ".join(one.name for one in candidates)
    return render_page(
        title=f"Comparison of {names}" if several else f"Simulation of {names} over the log",
        subtitle=f"made with drivetwin {get_program_version()}",
        sections=[section for section in sections if section.blocks],
    )


def make_trial_label(log: str, shift: Shift) -> str:
    """Name log and shift of a trial."""
    return f"{log}, {shift.start_gear}→{shift.end_gear} at {shift.lockup_time:.1f} s"


def simulate_trials(
    twins: Mapping[str, Twin], log: ShiftLog, shifts: Sequence[Shift], name: str
) -> list[Trial]:
    """Simulate every shift of a log, called `name`, with every twin.

    A twin that lacks a parameter, gear or channel is named in `refused`. Progress is reported.
    """
    trials = []
    for count, shift in enumerate(shifts):
        label = make_trial_label(name, shift)
        runs: dict[str, Validation] = {}
        refused: dict[str, str] = {}
        for place, (twin_name, twin) in enumerate(twins.items()):
            notify_progress((count + place / len(twins)) / len(shifts))
            try:
                runs[twin_name] = simulate_shift(twin, log, shift)
            except DrivetwinError as fault:
                refused[twin_name] = fault.what
        trials.append(Trial(label, runs, refused))
    return trials
