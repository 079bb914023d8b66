# SPDX-License-Identifier: MIT
"""The comparison: several identifications, and logs that each of them simulates, on one page."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from drivetwin._util.display_units import (
    format_significant,
    get_display_unit,
)
from drivetwin._util.optional_dependencies import get_program_version
from drivetwin._util.progress import notify_progress
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.result.validation import Validation
from drivetwin.report.blocks import (
    Block,
    Cell,
    Column,
    FigureBlock,
    Page,
    Section,
    TableBlock,
    Tile,
    TilesBlock,
    Tone,
    make_badge,
    make_notes,
    make_number,
    make_table,
)
from drivetwin.report.figure import get_estimate_label
from drivetwin.report.find_reports import DIFFER, Agreement, Candidate, Trial, compare_estimates
from drivetwin.report.parameters import make_estimate_cell, make_value_cell
from drivetwin.report.summary import build_labelled_fits
from drivetwin.report.together import (
    plot_agreement,
    plot_fit_matrix,
    plot_friction_overlay,
    plot_trial,
)
from drivetwin.shifts.shift import Shift
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import SIGNALS, simulate_shift


def build_comparison_page(candidates: Sequence[Candidate], trials: Sequence[Trial]) -> Page:
    """Build the page of a comparison; with one candidate it shows the logs alone."""
    several = len(candidates) > 1
    sections = [
        *([build_agreement_section(candidates)] if several else []),
        *build_trial_sections(candidates, trials),
        build_friction_overlay_section(candidates),
        build_origin_section(candidates),
    ]
    names = ", ".join(one.name for one in candidates)
    return Page(
        title=f"Comparison of {names}" if several else f"Simulation of {names} over the log",
        subtitle=f"made with drivetwin {get_program_version()}",
        sections=sections,
    )


def make_trial_label(log: str, shift: Shift) -> str:
    """Name log and shift of a trial."""
    return f"{log}, {shift.name} at {shift.lockup_time:.1f} s"


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


def build_agreement_section(candidates: Sequence[Candidate]) -> Section:
    """Build the section that compares the parameters and tests their agreement."""
    found = compare_estimates([one.estimates for one in candidates])
    judged = [one for one in found if one.agrees is not None]
    differing = [one for one in judged if not one.agrees]
    blocks: list[Block] = [TilesBlock(_build_tiles(candidates, judged, differing))]
    texts = [
        f"{get_estimate_label(one.known)}: {format_significant(one.apart or 0.0, 2)} "
        f"standard deviations"
        for one in differing
    ]
    blocks += make_notes("Differ by more than their uncertainty", texts, Tone.DOUBTFUL)
    blocks.append(_build_parameter_table(candidates, found))
    if judged:
        blocks.append(
            FigureBlock(
                plot_agreement([one.name for one in candidates], judged),
                "Each value against the mean of all (weighted by their uncertainty) with its total "
                "95 % interval, in standard deviations of the parameter. Where intervals do not "
                "overlap, the difference needs an explanation.",
            )
        )
    return Section("agreement", "Do they agree?", _write_headline(judged, differing), blocks)


def _write_headline(judged: Sequence[Agreement], differing: Sequence[Agreement]) -> str:
    if not judged:
        return "No parameter has an uncertainty in two of the results."
    text = f"{len(judged) - len(differing)} of {len(judged)} common parameters agree"
    return f"{text} within their total uncertainty ({DIFFER} standard deviations)."


def _build_tiles(
    candidates: Sequence[Candidate], judged: Sequence[Agreement], differing: Sequence[Agreement]
) -> list[Tile]:
    tone = Tone.DOUBTFUL if differing else Tone.GOOD
    tiles = [
        Tile("compared", str(len(candidates)), note="results"),
        Tile("agree", f"{len(judged) - len(differing)} of {len(judged)}", tone, "parameters"),
    ]
    for one in candidates:
        fit = one.fit.get("output_torque", {}).get("all")
        if fit is not None and math.isfinite(fit.fit_percent):
            tiles.append(
                Tile(
                    f"fit of {one.name}", f"{fit.fit_percent:z.1f} %", note="output torque, own log"
                )
            )
    return tiles


def _build_parameter_table(
    candidates: Sequence[Candidate], found: Sequence[Agreement]
) -> TableBlock:
    rows = []
    for one in found:
        display = get_display_unit(one.known.unit)
        values = (make_value_cell(each, display) for each in one.estimates)
        verdict = _make_verdict_cell(one, candidates)
        rows.append((make_estimate_cell(one.known), *values, display.label, one.apart, verdict))
    names = (make_number(one.name, "± 95 % total") for one in candidates)
    columns: Sequence[Column] = ("parameter", *names, "unit", ("apart", "2", "σ"), "verdict")
    return make_table("Parameters side by side.", columns, rows)


def _make_verdict_cell(one: Agreement, candidates: Sequence[Candidate]) -> Cell:
    bare = ", ".join(candidates[k].name for k in one.bare)
    note = f"no interval: {bare}" if bare else ""
    if one.agrees is None:
        alone = sum(each is not None and each.value is not None for each in one.estimates) < 2
        return Cell("") if alone else make_badge("not judged", Tone.UNKNOWN, note)
    word, tone = ("agree", Tone.GOOD) if one.agrees else ("differ", Tone.DOUBTFUL)
    return make_badge(word, tone, note)


def build_friction_overlay_section(candidates: Sequence[Candidate]) -> Section:
    """μ over slip of every element, one curve per candidate."""
    order = [one.name for one in candidates]
    elements = dict.fromkeys(element for one in candidates for element in one.friction)
    blocks = [
        FigureBlock(
            plot_friction_overlay(
                element,
                {c.name: c.friction[element] for c in candidates if element in c.friction},
                order,
            ),
            f"Friction of {element}, each curve over the slip range of its log.",
        )
        for element in elements
    ]
    return Section("friction", "Friction", "Bands hold 95 %, sensors and effects included.", blocks)


def build_trial_sections(candidates: Sequence[Candidate], trials: Sequence[Trial]) -> list[Section]:
    """Every log simulated by every candidate: the fit of all, then shift by shift."""
    if not trials:
        return []
    order = [one.name for one in candidates]
    matrix = FigureBlock(
        plot_fit_matrix(order, [one.label for one in trials], _collect_fit_percent(order, trials)),
        "Fit [%] of the output torque over the whole shift; a dash where the log has none or the "
        "simulation was not possible.",
    )
    shifts: list[Block] = []
    for trial in trials:
        if trial.runs:
            shift = next(iter(trial.runs.values())).shift
            shifts.append(
                FigureBlock(
                    plot_trial(trial, order),
                    f"{trial.label}: measured, and simulated by each model from measured inputs.",
                    trial.label,
                )
            )
            shifts.append(_build_trial_table(trial, shift))
        texts = [f"{name}: {why}" for name, why in trial.refused.items()]
        shifts += make_notes(f"Not simulated: {trial.label}", texts, Tone.DOUBTFUL)
    each = Section("shifts", "Shift by shift", "Residuals are measured minus simulated.", shifts)
    if len(candidates) == 1 and len(trials) == 1:
        return [each]
    return [
        Section(
            "logs",
            "Which model fits which log?",
            "Each model is driven by the measured inputs of each log, its own or another's.",
            [matrix],
        ),
        each,
    ]


def _collect_fit_percent(order: Sequence[str], trials: Sequence[Trial]) -> list[list[float | None]]:
    rows: list[list[float | None]] = []
    for name in order:
        fits = [
            trial.runs[name].fit.get("output_torque", {}).get("all") if name in trial.runs else None
            for trial in trials
        ]
        rows.append(
            [one.fit_percent if one and math.isfinite(one.fit_percent) else None for one in fits]
        )
    return rows


def _build_trial_table(trial: Trial, shift: Shift) -> TableBlock:
    fits = {
        name: {signal: run.fit[signal] for signal in SIGNALS if signal in run.fit}
        for name, run in trial.runs.items()
    }
    caption = (
        f"Fit by phase, {trial.label}: {shift.offgoing} off-going, {shift.oncoming} on-coming."
    )
    return build_labelled_fits(fits, caption, "model")


def build_origin_section(candidates: Sequence[Candidate]) -> Section:
    """List the source files of each candidate."""
    rows = [
        (one.name, one.method, one.version, file, digest)
        for one in candidates
        for file, digest in one.inputs.items()
    ]
    columns = ("identification", "method", "version", "input", "SHA-256")
    table = make_table("", columns, rows)
    return Section("origin", "Origin", "Inputs of each identification.", [table])
