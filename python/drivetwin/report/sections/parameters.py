# SPDX-License-Identifier: MIT
"""First sections: verdict on the model, its parameters, and the findings by severity."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from drivetwin._util.display_units import (
    Display,
    format_uncertainty,
    get_display_unit,
    scale_display,
)
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Z95, Estimate, Verdict
from drivetwin.estimation.result.status import ModelStatus
from drivetwin.estimation.result.validation import Validation
from drivetwin.findings import Finding, Severity, render
from drivetwin.report.figures.validation import build_overview_panels, plot_overview
from drivetwin.report.labels import get_estimate_label, get_estimate_name
from drivetwin.report.model_verdict import explain_identification
from drivetwin.report.sections.blocks import (
    Block,
    Cell,
    FigureBlock,
    NotesBlock,
    Section,
    TableBlock,
    Tone,
    VerdictBlock,
    make_cells,
    make_link,
)

TONES = {
    Verdict.IDENTIFIED: Tone.GOOD,
    Verdict.WEAK: Tone.DOUBTFUL,
    Verdict.NOT_IDENTIFIABLE: Tone.UNKNOWN,
    Verdict.DESIGN: Tone.PLAIN,
}
STATUS_TONES = {
    ModelStatus.VALID: Tone.GOOD,
    ModelStatus.LIMITED: Tone.DOUBTFUL,
    ModelStatus.NOT_VALID: Tone.BAD,
    ModelStatus.NOT_VALIDATED: Tone.DOUBTFUL,
}
_SEVERITIES = (
    (Severity.ERROR, "Errors", Tone.BAD),
    (Severity.WARNING, "Warnings", Tone.DOUBTFUL),
    (Severity.INFO, "Information", Tone.PLAIN),
)


def build_result_section(found: Identification) -> Section:
    """Verdict, simulation over measurement of one shift, parameters and their remarks."""
    blocks: list[Block] = [_build_verdict_block(found)]
    if found.evidence.validation:
        blocks.append(_build_overview(found.evidence.validation))
    blocks += build_parameter_blocks(found.estimates)
    return Section("result", "Result", "", blocks)


def build_parameter_blocks(
    estimates: Mapping[str, Estimate], caption: str | None = None
) -> list[Block]:
    """Table of the parameters, and the reasons of their verdicts."""
    remarks = [
        f"({number}) {', '.join(_list_labels(estimates, reason))}: {reason}"
        for reason, number in _number_reasons(estimates.values()).items()
    ]
    notes = [NotesBlock("Remarks on parameters", remarks)] if remarks else []
    return [build_parameter_table(estimates, caption), *notes]


def build_findings_section(findings: Sequence[Finding]) -> Section:
    """Findings by severity, errors first, each group with the tables of its findings."""
    blocks: list[Block] = []
    for severity, heading, tone in _SEVERITIES:
        alike = [one for one in findings if one.severity is severity]
        if alike:
            blocks.append(NotesBlock(heading, render(alike), tone))
        blocks += [_build_rows_table(one) for one in alike if one.rows]
    intro = "Remarks on log, vehicle card and fit, with cause and remedy."
    return Section("findings", "Findings", intro, blocks)


def _build_rows_table(one: Finding) -> TableBlock:
    """Build the table of a finding; its caption is the cause."""
    rows = [make_cells(*cells) for cells in one.cells]
    return TableBlock(one.cause, make_cells(*one.heads), rows)


def _build_verdict_block(found: Identification) -> VerdictBlock:
    verdict = explain_identification(found)
    tone = STATUS_TONES[verdict.status]
    return VerdictBlock(verdict.status.value, verdict.reason, verdict.action, tone)


def _build_overview(validations: Sequence[Validation]) -> FigureBlock:
    """Draw the shift whose output torque, else input speed, is followed least."""
    shown = min(validations, key=_get_fit_percent)
    shift = shown.shift
    text = f"Shift {shift.start_gear}→{shift.end_gear}, measured and simulated"
    if len(validations) > 1:
        text += f": the one of {len(validations)} shifts with the lowest fit"
    panels = build_overview_panels(shown)
    text += ". 1 gear held, 2 torque phase, 3 inertia phase, 4 new gear locked."
    return FigureBlock(plot_overview(shown), text, panels, make_link(shift))


def _get_fit_percent(one: Validation) -> float:
    """Fit of the first compared signal [%]; one without a fit comes last."""
    fits = next(iter(one.fit.values()), {})
    percent = fits["all"].fit_percent if "all" in fits else float("nan")
    return percent if percent == percent else float("inf")


def _count_parameters(estimates: Mapping[str, Estimate]) -> str:
    """Count the verdicts in a sentence."""
    count = Counter(estimate.verdict for estimate in estimates.values())
    text = f"{count[Verdict.IDENTIFIED]} of {len(estimates)} parameters are identified"
    for verdict, words in (
        (Verdict.WEAK, "weak"),
        (Verdict.NOT_IDENTIFIABLE, "not identifiable from this log"),
        (Verdict.DESIGN, "taken from the vehicle card"),
    ):
        if count[verdict]:
            text += f", {count[verdict]} {words}"
    return f"{text}."


def build_parameter_table(
    estimates: Mapping[str, Estimate], caption: str | None = None
) -> TableBlock:
    """All parameters with their intervals and verdicts; the caption counts the latter if None."""
    head = (
        Cell("parameter"),
        Cell("value", number=True),
        Cell("± 95 %", number=True, note="sensors and effects"),
        Cell("± 95 %", number=True, note="noise alone", secondary=True),
        Cell("unit"),
        Cell("verdict"),
        Cell("method", secondary=True),
    )
    counted = _count_parameters(estimates)
    if not any(one.std_systematic for one in estimates.values()):
        counted += (
            " The vehicle card states no sensor tolerance, so both intervals are of noise alone."
        )
    numbers = _number_reasons(estimates.values())
    rows = [
        _build_parameter_row(one, f" ({numbers[one.reason]})" if one.reason else "")
        for one in estimates.values()
    ]
    return TableBlock(counted if caption is None else caption, head, rows)


def _number_reasons(estimates: Iterable[Estimate]) -> dict[str, int]:
    """The different reasons of verdicts, numbered from 1 in the order of the parameters."""
    reasons = dict.fromkeys(one.reason for one in estimates if one.reason)
    return {reason: number for number, reason in enumerate(reasons, start=1)}


def _list_labels(estimates: Mapping[str, Estimate], reason: str) -> list[str]:
    return [get_estimate_label(one) for one in estimates.values() if one.reason == reason]


def _build_parameter_row(estimate: Estimate, mark: str) -> tuple[Cell, ...]:
    display = scale_display(get_display_unit(estimate.unit), estimate.value or 0.0)
    value, total = format_estimate(estimate, estimate.std_total, display)
    _, noise = format_estimate(estimate, estimate.std_noise, display)
    is_symbol = get_estimate_label(estimate) == estimate.id
    return (
        Cell(get_estimate_name(estimate), note="" if is_symbol else estimate.id),
        Cell(value, number=True),
        Cell(total, number=True),
        Cell(noise, number=True, secondary=True),
        Cell(display.label),
        Cell(f"{estimate.verdict.value}{mark}", badge=True, tone=TONES[estimate.verdict]),
        Cell(estimate.method, secondary=True),
    )


def format_estimate(estimate: Estimate, std: float | None, display: Display) -> tuple[str, str]:
    """Format a value and the half width of its 95 % interval; dashes for what is missing."""
    if estimate.value is None:
        return "–", "–"
    half = None if std is None else Z95 * std * display.factor
    value, width = format_uncertainty(estimate.value * display.factor, half)
    return value, width or "–"
