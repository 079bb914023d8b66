# SPDX-License-Identifier: MIT
"""Section of the findings by severity."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin.findings import Finding, Severity, render
from drivetwin.report.blocks import Block, Section, Tone, make_notes, make_table

_SEVERITIES = (
    (Severity.ERROR, "Errors", Tone.BAD),
    (Severity.WARNING, "Warnings", Tone.DOUBTFUL),
    (Severity.INFO, "Information", Tone.PLAIN),
)


def build_findings_section(findings: Sequence[Finding]) -> Section:
    """Findings by severity, errors first, each group with the tables of its findings."""
    blocks: list[Block] = []
    for severity, heading, tone in _SEVERITIES:
        alike = [one for one in findings if one.severity is severity]
        blocks += make_notes(heading, render(alike), tone)
        blocks += [make_table(one.cause, one.heads, one.cells) for one in alike if one.rows]
    intro = "Remarks on log, vehicle card and fit, with cause and remedy."
    return Section("findings", "Findings", intro, blocks)
