# SPDX-License-Identifier: MIT
"""The report of an identification from several logs, or with shifts held out of the fit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from drivetwin._util.atomic import write_text
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.multi_log.fit import extract_log
from drivetwin.estimation.result.multi_log import Several
from drivetwin.report.blocks import Section
from drivetwin.report.html import PAGE, build_report_sections, render_page
from drivetwin.report.sections.findings import build_findings_section
from drivetwin.report.sections.identifiability import build_limits_section
from drivetwin.report.sections.likelihood import build_likelihood_sections
from drivetwin.report.sections.parameters import build_result_section
from drivetwin.report.sections.provenance import build_provenance_section
from drivetwin.report.sections.summary import (
    build_friction_section,
    build_shift_section,
    build_validation_section,
)
from drivetwin.report.sections.together import (
    build_holdout_section,
    build_joint_section,
    prefix_log_section,
)

_OPENING = ("result", "findings", "logs")
"""Sections before that of the held-out shifts."""


def save_joint_report(path: Path | str, found: Identification, logs: Sequence[ShiftLog]) -> None:
    """Write the report; the file appears whole or not at all. `logs` are those fitted, in order."""
    write_text(path, render_joint_report(found, logs))


def render_joint_report(found: Identification, logs: Sequence[ShiftLog]) -> str:
    """HTML text of the report; equal inputs give equal text."""
    several = found.evidence.several
    held = found.evidence.held_out
    with PAGE.enter("sections"):
        if several is None:
            sections = build_report_sections(found, logs[0])
        else:
            sections = list(_build_joint_sections(found, several, logs))
    if held:
        place = sum(section.anchor in _OPENING for section in sections)
        sections.insert(place, build_holdout_section(found, held))
    names = " and ".join(Path(log.source).name for log in logs)
    predicted = f" · {_format_shift_count(len(held))} predicted" if held else ""
    return render_page(
        title=f"Driveline model from {names}",
        subtitle=(
            f"{_format_shift_count(len(found.shifts))} fitted{predicted} · method "
            f"{found.method.value} · "
            f"loss law {found.loss_law}"
        ),
        sections=[section for section in sections if section.blocks],
    )


def _format_shift_count(count: int) -> str:
    return "1 shift" if count == 1 else f"{count} shifts"


def _build_joint_sections(
    found: Identification, several: Several, logs: Sequence[ShiftLog]
) -> Iterator[Section]:
    """The sections of all logs in reading order; stages of single shifts are in their reports."""
    yield build_result_section(found)
    yield build_findings_section(found.findings)
    yield build_joint_section(found, several)
    for share, log in zip(several.logs, logs, strict=True):
        own = {id(shift) for shift in share.shifts}  # a log that was not simulated has no runs
        runs = tuple(run for run in found.evidence.validation if id(run.shift) in own)
        yield prefix_log_section(build_validation_section(runs), share)
        yield prefix_log_section(build_shift_section(extract_log(found, share), log), share)
    yield build_friction_section(found)
    yield from build_likelihood_sections(found)
    yield build_limits_section(found)
    yield build_provenance_section(found)
