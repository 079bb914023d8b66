# SPDX-License-Identifier: MIT
"""First page: can I trust this model?"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence

from drivetwin._util.display_units import (
    NM,
    RPM,
    Display,
    format_significant,
    format_uncertainty,
    get_display_unit,
)
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.diagnostics.residual_tests import run_residual_tests
from drivetwin.estimation.result.estimate import Z95, Estimate, SignalFit, Verdict
from drivetwin.estimation.result.status import ModelStatus
from drivetwin.findings import Finding, render, select_warnings
from drivetwin.parameters import get_parameter_spec
from drivetwin.report.figures.parameters import plot_intervals
from drivetwin.report.labels import get_parameter_label
from drivetwin.report.model_verdict import explain_identification
from drivetwin.report.sections.blocks import (
    Block,
    Cell,
    FigureBlock,
    NotesBlock,
    Section,
    TableBlock,
    Tile,
    TilesBlock,
    Tone,
    VerdictBlock,
)

TONES = {
    Verdict.IDENTIFIED: Tone.GOOD,
    Verdict.WEAK: Tone.DOUBTFUL,
    Verdict.NOT_IDENTIFIABLE: Tone.UNKNOWN,
    Verdict.DESIGN: Tone.PLAIN,
}
SIGNALS: dict[str, tuple[str, Display]] = {
    "output_torque": ("output torque", NM),
    "input_speed": ("input speed", RPM),
    "output_speed": ("output speed", RPM),
}
PHASES = {
    "all": "whole",
    "before": "1 before",
    "torque": "2 torque phase",
    "inertia": "3 inertia phase",
    "after": "4 after lock-up",
}

FITS = 80.0
"""Fit [%] from which the simulation counts as one of the signal ..."""
UNEVEN = 1.5
"""... in every phase too that has an error so many times that of the whole."""


def build_parameters_section(found: Identification) -> Section:
    """Verdicts, agreement and warnings at a glance, then the parameter table."""
    blocks: list[Block] = [build_verdict_block(found), TilesBlock(_build_tiles(found))]
    blocks += _build_findings(found.findings)
    blocks.append(build_parameter_table(found))
    if found.fit:
        blocks.append(build_fit_table(found))
    blocks.append(
        FigureBlock(
            plot_intervals(found.estimates),
            "How narrowly each parameter is known. Dots: noise, sensor tolerances on the card and "
            "effects that the model leaves out; bars: noise alone.",
        )
    )
    return Section("trust", "Can I trust this model?", _write_headline(found), blocks)


def _build_findings(findings: Sequence[Finding]) -> list[Block]:
    """Build the lists of warnings and of remarks."""
    warnings = select_warnings(findings)
    remarks = [one for one in findings if one not in warnings]
    named = (("Warnings", warnings, Tone.DOUBTFUL), ("Remarks", remarks, Tone.PLAIN))
    return [NotesBlock(head, render(those), tone) for head, those, tone in named if those]


def _write_headline(found: Identification) -> str:
    count = _count_verdicts(found)
    identified = f"{count[Verdict.IDENTIFIED]} of {len(found.estimates)}"
    text = f"{identified} parameters are identified"
    if count[Verdict.WEAK]:
        text += f", {count[Verdict.WEAK]} only weakly"
    if count[Verdict.NOT_IDENTIFIABLE]:
        text += f", {count[Verdict.NOT_IDENTIFIABLE]} cannot be told from this log"
    if count[Verdict.DESIGN]:
        text += f", {count[Verdict.DESIGN]} taken from the vehicle card"
    text += "."
    fit = found.fit.get("output_torque", {}).get("all")
    if fit is not None and math.isfinite(fit.fit_percent):
        text += (
            f" Driven by the measured inputs alone, the model reproduces the output torque with a "
            f"fit of {format_significant(fit.fit_percent, 3)} %."
        )
    return text


def count_consistent_residuals(found: Identification) -> tuple[int, int]:
    """Tests of the likelihood's residuals: how many passed, of how many; (0, 0) without any."""
    fit = found.evidence.likelihood
    if fit is None:
        return 0, 0
    tests = [test for group in run_residual_tests(fit).values() for test in group]
    total = sum(1 + len(test.correlation) for test in tests)
    return total - sum(len(test.findings) for test in tests), total


def _count_verdicts(found: Identification) -> Counter[Verdict]:
    return Counter(estimate.verdict for estimate in found.estimates.values())


STATUS_TONES = {
    ModelStatus.VALID: Tone.GOOD,
    ModelStatus.LIMITED: Tone.DOUBTFUL,
    ModelStatus.NOT_VALID: Tone.BAD,
    ModelStatus.NOT_VALIDATED: Tone.DOUBTFUL,
}


def build_verdict_block(found: Identification) -> VerdictBlock:
    """Build the box with the verdict on the model."""
    told = explain_identification(found)
    tone = STATUS_TONES[told.status]
    return VerdictBlock(told.status.value, told.reason, told.action, tone)


def _build_tiles(found: Identification) -> list[Tile]:
    tiles = []
    for name, (label, display) in SIGNALS.items():
        fits = found.fit.get(name, {})
        if "all" in fits:
            fit, missed = fits["all"], _find_missed_phase(fits)
            note = f"rmse {format_significant(fit.rmse * display.factor, 3)} {display.label}"
            if missed not in ("", "all"):
                note += f"; {PHASES[missed]}: {_format_percent(fits[missed])}"
            tone = Tone.DOUBTFUL if missed else Tone.GOOD
            tiles.append(Tile(f"fit of {label}", _format_percent(fit), tone, note))
    passed, tests = count_consistent_residuals(found)
    if tests:
        tone = Tone.GOOD if passed == tests else Tone.DOUBTFUL
        tiles.append(Tile("residual tests passed", f"{passed} of {tests}", tone, "see the fit"))
    count = _count_verdicts(found)
    complete = not count[Verdict.WEAK] and not count[Verdict.NOT_IDENTIFIABLE]
    tiles.append(
        Tile(
            "identified",
            f"{count[Verdict.IDENTIFIED]} of {len(found.estimates)}",
            Tone.GOOD if complete else Tone.DOUBTFUL,
            "parameters",
        )
    )
    warnings = select_warnings(found.findings)
    tone = Tone.DOUBTFUL if warnings else Tone.GOOD
    tiles.append(Tile("warnings", str(len(warnings)), tone))
    return tiles


def build_parameter_table(found: Identification) -> TableBlock:
    """All parameters with their intervals and verdicts."""
    head = (
        Cell("parameter"),
        Cell("value", number=True),
        Cell("± 95 %", number=True, note="sensors and effects"),
        Cell("± 95 %", number=True, note="noise alone"),
        Cell("unit"),
        Cell("verdict"),
        Cell("method", secondary=True),
    )
    caption = "Parameters."
    if not any(one.std_systematic for one in found.estimates.values()):
        caption += (
            " The vehicle card states no sensor tolerance, so both intervals are of noise alone."
        )
    first: dict[str, str] = {}
    rows = []
    for one in found.estimates.values():
        label = get_parameter_label(one.id)
        owner = first.setdefault(one.reason, label)
        rows.append(_build_parameter_row(one, one.reason if owner == label else f"as for {owner}"))
    return TableBlock(caption, head, rows)


def _build_parameter_row(estimate: Estimate, remark: str) -> tuple[Cell, ...]:
    spec = get_parameter_spec(estimate.id)
    display = get_display_unit(estimate.unit)
    value, total = _format_estimate(estimate, estimate.std_total, display)
    _, noise = _format_estimate(estimate, estimate.std_noise, display)
    return (
        Cell(
            get_parameter_label(estimate.id),
            note=f"{spec.meaning} · {estimate.id}",
            remark=remark if estimate.reason else "",
        ),
        Cell(value, number=True),
        Cell(total, number=True),
        Cell(noise, number=True),
        Cell(display.label),
        Cell(estimate.verdict.value, badge=True, tone=TONES[estimate.verdict]),
        Cell(estimate.method, secondary=True),
    )


def _format_estimate(estimate: Estimate, std: float | None, display: Display) -> tuple[str, str]:
    if estimate.value is None:
        return "–", "–"
    half = None if std is None else Z95 * std * display.factor
    value, width = format_uncertainty(estimate.value * display.factor, half)
    return value, width or "–"


def build_fit_table(found: Identification) -> TableBlock:
    """Fit % and rmse by signal and phase."""
    head = [Cell("signal"), *(Cell(label, number=True) for label in PHASES.values())]
    rows = []
    for name, (label, display) in SIGNALS.items():
        if name not in found.fit:
            continue
        fits = [found.fit[name].get(phase) for phase in PHASES]
        rows.append([Cell(label), *(make_fit_cell(fit, display) for fit in fits)])
    return TableBlock(
        "Simulation against measurement: fit % = 100·(1 − ‖y − ŷ‖ / ‖y − mean(y)‖), the mean taken "
        "over the whole log for every phase; root mean square error below. Where a signal hardly "
        "moves, fit % is low although only noise is left: the error in its unit tells.",
        head,
        rows,
    )


def make_fit_cell(fit: SignalFit | None, display: Display) -> Cell:
    """Format the fit in % with the error in its unit below; a dash without a fit."""
    if fit is None:
        return Cell("–", number=True)
    note = f"{format_significant(fit.rmse * display.factor, 3)} {display.label}"
    return Cell(_format_percent(fit), number=True, note=note)


def _format_percent(fit: SignalFit) -> str:
    return f"{fit.fit_percent:.1f} %" if math.isfinite(fit.fit_percent) else "–"


def _find_missed_phase(fits: Mapping[str, SignalFit]) -> str:
    """Phase of a signal that the simulation misses: "all", else the worst; empty for none.

    A phase in which the signal hardly moves has a low fit although only noise is left, of which it
    has no more than the others.
    """
    whole = fits["all"]
    if not whole.fit_percent >= FITS:
        return "all"
    uneven = [phase for phase, one in fits.items() if one.rmse > UNEVEN * whole.rmse]
    low = [phase for phase in uneven if fits[phase].fit_percent < FITS]
    return min(low, key=lambda phase: fits[phase].fit_percent, default="")
