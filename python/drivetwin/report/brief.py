# SPDX-License-Identifier: MIT
"""A result in a few blocks without figures, for terminal and notebook."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from drivetwin.estimation.identification import Identification
from drivetwin.report.blocks import Block, TextBlock, build_findings_section
from drivetwin.report.model_verdict import build_verdict_block, explain_identification
from drivetwin.report.sections.fits import build_fit_table
from drivetwin.report.sections.identifiability import build_suggestion_blocks
from drivetwin.report.sections.parameters import build_parameter_blocks
from drivetwin.report.sections.summary import build_friction_table, build_phase_table
from drivetwin.report.sections.together import build_judgement_blocks, build_log_table
from drivetwin.shifts.shift import Shift, make_shift_labels


def build_identification_blocks(found: Identification) -> list[Block]:
    """Verdict, phases, parameters, friction, suggestions, fits, and the findings at the end."""
    evidence = found.evidence
    blocks: list[Block] = [build_verdict_block(explain_identification(found))]
    blocks += [build_phase_table(*one) for one in _label_shifts(found)]
    blocks += build_parameter_blocks(found.estimates)
    if found.friction:
        blocks.append(build_friction_table(found.friction))
    if evidence.suggestions:
        blocks += build_suggestion_blocks(evidence.suggestions, found.estimates)
    if evidence.several is not None:
        blocks += [
            build_log_table(found, evidence.several),
            TextBlock(evidence.several.consistency.text),
        ]
    elif found.fit:
        blocks.append(build_fit_table(found.fit))
    if evidence.held_out:
        blocks += build_judgement_blocks(found, evidence.held_out)
    return [*blocks, *build_findings_section(found.findings).blocks]


def _label_shifts(found: Identification) -> Iterator[tuple[str, Shift]]:
    """Yield the shifts that were fitted with their labels, of several logs with the file too."""
    several = found.evidence.several
    if several is None:
        yield from zip(make_shift_labels(found.shifts), found.shifts, strict=True)
        return
    for log in several.logs:
        for label, shift in zip(make_shift_labels(log.shifts), log.shifts, strict=True):
            yield f"{label} in {Path(log.source).name}", shift
