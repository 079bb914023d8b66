# SPDX-License-Identifier: MIT
"""The comparison: several identifications, and logs that each of them simulates, on one page."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._util.display_units import (
    format_significant,
    get_display_unit,
)
from drivetwin._util.optional_dependencies import get_program_version
from drivetwin._util.progress import notify_progress
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import DrivetwinError
from drivetwin.estimation.result.estimate import Estimate, FrictionCurve
from drivetwin.estimation.result.validation import Validation
from drivetwin.likelihood.output import SignalFit
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
from drivetwin.report.figure import MUTED, Figure, get_candidate_style, get_estimate_label
from drivetwin.report.parameters import make_estimate_cell, make_value_cell
from drivetwin.report.stack import Curve, Panel, stack_panels
from drivetwin.report.summary import build_labelled_fits
from drivetwin.report.together import (
    plot_friction_overlay,
)
from drivetwin.report.validation import OUTPUTS
from drivetwin.shifts.shift import Shift
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import SIGNALS, simulate_shift

DIFFER = 2.58
"""Difference in its standard deviations from which two values differ: 1 % by chance."""


@dataclass(frozen=True, eq=False)
class Candidate:
    """One identification under the `name` that tables and figures give it.

    `fit` by signal and phase is empty where only the twin is at hand.
    """

    name: str
    method: str
    estimates: Mapping[str, Estimate]
    friction: Mapping[str, FrictionCurve]
    fit: Mapping[str, Mapping[str, SignalFit]]
    inputs: Mapping[str, str]
    version: str

    @classmethod
    def from_twin(cls, name: str, twin: Twin) -> Candidate:
        """Create a candidate from a twin file."""
        return cls(name, twin.method, twin.parameters, twin.friction, {}, twin.inputs, twin.version)


@dataclass(frozen=True, eq=False)
class Trial:
    """One shift of a log, simulated by each candidate; `refused` holds the reasons of failures.

    `label` names log and shift.
    """

    label: str
    runs: Mapping[str, Validation]
    refused: Mapping[str, str]


@dataclass(frozen=True)
class Agreement:
    """One parameter over the candidates, in their order; None if a candidate has no estimate.

    `apart` is the largest difference of two candidates in its standard deviations (sensor
    tolerances included). A value without an interval is held against those of the others as if it
    were exact; None where no value with an interval has another beside it.
    """

    id: str
    estimates: tuple[Estimate | None, ...]
    apart: float | None

    @property
    def known(self) -> Estimate:
        """Estimate of the first candidate that has one."""
        return next(one for one in self.estimates if one is not None)

    @property
    def bare(self) -> tuple[int, ...]:
        """Indices of the candidates with a value but without an interval."""
        given = [(k, one) for k, one in enumerate(self.estimates) if one and one.value is not None]
        return tuple(k for k, one in given if not _has_interval(one.std_total))

    @property
    def agrees(self) -> bool | None:
        """True if the values agree within their uncertainty; None if the uncertainty is unknown."""
        return None if self.apart is None else self.apart <= DIFFER


def compare_estimates(candidates: Sequence[Mapping[str, Estimate]]) -> list[Agreement]:
    """Compare every parameter that some candidate estimates, in the order of the first such one."""
    ids = dict.fromkeys(name for one in candidates for name in one)
    found = (_compare_parameter(name, [one.get(name) for one in candidates]) for name in ids)
    return [one for one in found if one is not None]


def _compare_parameter(name: str, estimates: Sequence[Estimate | None]) -> Agreement | None:
    given = [(one.value, one.std_total) for one in estimates if one and one.value is not None]
    if not given:
        return None
    values = np.array([value for value, _ in given])
    stds = np.array([np.nan if std is None else std for _, std in given])
    known = np.array([_has_interval(std) for _, std in given])
    spread = np.where(known, stds, 0.0)
    apart = [
        abs(values[i] - values[j]) / np.hypot(spread[i], spread[j])
        for i in range(values.size)
        for j in range(i)
        if known[i] or known[j]
    ]
    return Agreement(name, tuple(estimates), float(max(apart)) if apart else None)


def _has_interval(std: float | None) -> bool:
    return std is not None and np.isfinite(std) and std > 0.0


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
    rows = [(one.label, *(_get_fit_percent(one, name) for name in order)) for one in trials]
    caption = (
        "Fit [%] of the output torque over the whole shift; a dash where the log has none or the "
        "simulation was not possible."
    )
    numbers = ((name, "z.1f") for name in order)
    matrix = make_table(caption, ("log and shift", *numbers), rows)
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


def _get_fit_percent(trial: Trial, name: str) -> float | None:
    """Return the fit of the output torque by a candidate [%]; None without one."""
    fits = trial.runs[name].fit if name in trial.runs else {}
    fit = fits.get("output_torque", {}).get("all")
    return fit.fit_percent if fit and math.isfinite(fit.fit_percent) else None


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


def plot_trial(trial: Trial, order: Sequence[str]) -> Figure:
    """One shift as measured and as each candidate simulates it, residuals below.

    `order` lists all candidates.
    """
    first = next(iter(trial.runs.values()))
    panels = []
    for name, (title, display, weight) in OUTPUTS.items():
        if name not in first.all_traces:
            continue
        seen = first.all_traces[name]
        over = [Curve("measured", seen.time, seen.measured, MUTED, width=1.0)]
        left = []
        for candidate, run in trial.runs.items():
            if name not in run.all_traces:
                continue
            trace, style = run.all_traces[name], get_candidate_style(order.index(candidate))
            over.append(
                Curve(candidate, trace.time, trace.simulated, style.colour, 1.3, style.dash)
            )
            difference = trace.measured - trace.simulated
            left.append(Curve(candidate, trace.time, difference, style.colour, 1.0, listed=False))
        panels += [Panel(title, display, over, weight), Panel("residual", display, left, 0.7)]
    return stack_panels(panels, first.phases, height=140 + 170 * len(panels))
