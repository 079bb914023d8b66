# SPDX-License-Identifier: MIT
"""First section: verdict on the model, and its parameters."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from drivetwin._util.display_units import (
    Display,
    format_uncertainty,
    get_display_unit,
    scale_display,
)
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Z95, Estimate, Verdict
from drivetwin.estimation.result.validation import Validation
from drivetwin.report.blocks import (
    Block,
    Cell,
    FigureBlock,
    Section,
    TableBlock,
    Tone,
    make_badge,
    make_link,
    make_notes,
    make_number,
    make_table,
)
from drivetwin.report.figure import get_estimate_label, get_estimate_name, get_parameter_label
from drivetwin.report.figures.validation import plot_overview
from drivetwin.report.model_verdict import build_verdict_block, explain_identification

TONES = {
    Verdict.IDENTIFIED: Tone.GOOD,
    Verdict.WEAK: Tone.DOUBTFUL,
    Verdict.NOT_IDENTIFIABLE: Tone.UNKNOWN,
    Verdict.DESIGN: Tone.PLAIN,
}


def build_result_section(found: Identification) -> Section:
    """Verdict, simulation over measurement of one shift, parameters and their remarks."""
    blocks: list[Block] = [build_verdict_block(explain_identification(found))]
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
    table = build_parameter_table(estimates, caption)
    return [table, *make_notes("Remarks on parameters", remarks)]


def _build_overview(validations: Sequence[Validation]) -> FigureBlock:
    """Draw the shift whose output torque, else input speed, is followed least."""
    shown = min(validations, key=_get_fit_percent)
    shift = shown.shift
    text = f"Shift {shift.name}, measured and simulated"
    if len(validations) > 1:
        text += f": the one of {len(validations)} shifts with the lowest fit"
    text += ". 1 gear held, 2 torque phase, 3 inertia phase, 4 new gear locked."
    return FigureBlock(plot_overview(shown), text, make_link(shift))


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
    is_noise_alone = not any(one.std_systematic for one in estimates.values())
    columns = (
        "parameter",
        ("value", "s"),
        ("± 95 %", "s", "" if is_noise_alone else "sensors and effects"),
        make_number("± 95 %", "noise alone", secondary=True),
        "unit",
        "verdict",
        Cell("method", secondary=True),
    )
    counted = _count_parameters(estimates)
    if is_noise_alone:
        counted += (
            " The vehicle card states no sensor tolerance, so both intervals are of noise alone."
        )
    numbers = _number_reasons(estimates.values())
    rows = (
        _build_parameter_row(one, f" ({numbers[one.reason]})" if one.reason else "")
        for one in estimates.values()
    )
    return make_table(counted if caption is None else caption, columns, rows)


def _number_reasons(estimates: Iterable[Estimate]) -> dict[str, int]:
    """The different reasons of verdicts, numbered from 1 in the order of the parameters."""
    reasons = dict.fromkeys(one.reason for one in estimates if one.reason)
    return {reason: number for number, reason in enumerate(reasons, start=1)}


def _list_labels(estimates: Mapping[str, Estimate], reason: str) -> list[str]:
    return [get_estimate_label(one) for one in estimates.values() if one.reason == reason]


def _build_parameter_row(estimate: Estimate, mark: str) -> tuple[object, ...]:
    display = scale_display(get_display_unit(estimate.unit), estimate.value or 0.0)
    value, total = format_estimate(estimate, estimate.std_total, display)
    _, noise = format_estimate(estimate, estimate.std_noise, display)
    name = replace(make_estimate_cell(estimate), text=get_estimate_name(estimate))
    verdict = make_badge(f"{estimate.verdict.value}{mark}", TONES[estimate.verdict])
    return name, value, total, noise, display.label, verdict, estimate.method


def format_estimate(estimate: Estimate, std: float | None, display: Display) -> tuple[str, str]:
    """Format a value and the half width of its 95 % interval; dashes for what is missing."""
    if estimate.value is None:
        return "–", "–"
    half = None if std is None else Z95 * std * display.factor
    value, width = format_uncertainty(estimate.value * display.factor, half)
    return value, width or "–"


def make_parameter_cell(name: str) -> Cell:
    """Make the cell of a parameter: its symbol, and below it the id by which commands name it."""
    label = get_parameter_label(name)
    return Cell(label, note="" if label == name else name)


def make_estimate_cell(one: Estimate) -> Cell:
    """Make the cell of an estimate: its symbol, and below it the id by which commands name it."""
    label = get_estimate_label(one)
    return Cell(label, note="" if label == one.id else one.id)


def make_value_cell(one: Estimate | None, display: Display) -> Cell:
    """Format a value with its total 95 % half width below; a dash without a value."""
    if one is None or one.value is None:
        return make_number("–", "" if one is None else one.verdict.value)
    value, width = format_estimate(one, one.std_total, display)
    return make_number(value, "" if width == "–" else f"± {width}")
