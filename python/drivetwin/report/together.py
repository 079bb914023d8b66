# SPDX-License-Identifier: MIT
"""The report of an identification from several logs, or with shifts held out of the fit."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from drivetwin._util.atomic import write_text
from drivetwin._util.progress import part
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.multi_log.fit import of_one_log
from drivetwin.estimation.result.multi_log import Several
from drivetwin.report.html import render_page, report_sections
from drivetwin.report.sections.blocks import Section
from drivetwin.report.sections.identifiability import limits_section
from drivetwin.report.sections.likelihood import likelihood_sections
from drivetwin.report.sections.parameters import trust_section
from drivetwin.report.sections.provenance import provenance_section
from drivetwin.report.sections.summary import friction_section, shift_section, validation_section
from drivetwin.report.sections.together import held_out_section, of_log, several_section


def save_together(path: Path | str, found: Identification, logs: Sequence[ShiftLog]) -> None:
    """Write the report; the file appears whole or not at all. `logs` are those fitted, in order."""
    write_text(path, render_together(found, logs))


def render_together(found: Identification, logs: Sequence[ShiftLog]) -> str:
    """HTML text of the report; equal inputs give equal text."""
    several = found.evidence.several
    held = found.evidence.held_out
    with part(0.0, 0.5):
        if several is None:
            sections = report_sections(found, logs[0])
        else:
            sections = list(_of_several(found, several, logs))
    if held:
        sections.insert(1 if several is None else 2, held_out_section(found, held))
    names = " and ".join(Path(log.source).name for log in logs)
    predicted = f" · {_shifts(len(held))} predicted" if held else ""
    return render_page(
        title=f"Driveline model from {names}",
        subtitle=f"{_shifts(len(found.shifts))} fitted{predicted} · method {found.method.value} · "
        f"loss law {found.loss_law}",
        sections=[section for section in sections if section.blocks],
    )


def _shifts(count: int) -> str:
    return "1 shift" if count == 1 else f"{count} shifts"


def _of_several(
    found: Identification, several: Several, logs: Sequence[ShiftLog]
) -> Iterator[Section]:
    """The sections of all logs in reading order; stages of single shifts are in their reports."""
    yield trust_section(found)
    yield several_section(found, several)
    for share, log in zip(several.logs, logs, strict=True):
        yield of_log(shift_section(of_one_log(found, share), log), share)
        own = {id(shift) for shift in share.shifts}  # a log that was not simulated has no runs
        runs = tuple(run for run in found.evidence.validation if id(run.shift) in own)
        yield of_log(validation_section(runs), share)
    yield friction_section(found)
    yield from likelihood_sections(found)
    yield limits_section(found)
    yield provenance_section(found)
