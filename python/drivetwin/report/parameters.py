# SPDX-License-Identifier: MIT
"""Tables of parameters, and how well each is identified."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import isfinite

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import (
    Display,
    format_significant,
    format_uncertainty,
    get_display_unit,
    scale_display,
)
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import (
    Z95,
    CardNumber,
    CardNumberKind,
    Estimate,
    ExperimentRanking,
    Verdict,
)
from drivetwin.estimation.result.validation import Validation
from drivetwin.estimation.result.verdict import get_advice
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
    make_tables,
)
from drivetwin.report.figure import (
    DIVERGING,
    MUTED,
    VERDICT_COLOURS,
    Figure,
    get_estimate_label,
    get_estimate_name,
    get_parameter_label,
    make_axis,
    make_layout,
    make_trace,
)
from drivetwin.report.model_verdict import build_verdict_block, explain_identification
from drivetwin.report.validation import plot_overview

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


_TICKS = [scale * 10.0**power for power in range(-4, 4) for scale in (1.0, 2.0, 5.0)]
"""Labelled values of the logarithmic axis [%]."""


def plot_intervals(estimates: Mapping[str, Estimate]) -> Figure:
    """Half width of the 95 % interval relative to the value, total and noise alone, log axis.

    Parameters without an interval, design values, and times, which may be zero, are left out.
    """
    shown = [
        one
        for one in estimates.values()
        if one.verdict is not Verdict.DESIGN
        and one.unit != "s"
        and compute_half_width_percent(one.value, one.std_total) is not None
    ]
    figure = Figure()
    names = [get_parameter_label(one.id) for one in shown]
    figure.add_scatter(
        y=names,
        x=[compute_half_width_percent(one.value, one.std_total) for one in shown],
        mode="markers",
        name="total: noise and sensor tolerances",
        marker={"color": [VERDICT_COLOURS[one.verdict] for one in shown], "size": 11},
        hovertemplate="%{y}: ±%{x:.2g} %<extra></extra>",
    )
    figure.add_scatter(
        y=names,
        x=[compute_half_width_percent(one.value, one.std_noise) for one in shown],
        mode="markers",
        name="noise alone",
        marker={"color": MUTED, "symbol": "line-ns-open", "size": 12, "line": {"width": 2.5}},
        hovertemplate="%{y}: ±%{x:.2g} % from noise<extra></extra>",
    )
    figure.set_layout(
        make_layout(
            90 + 26 * len(shown),
            xaxis=make_axis(
                "half width of the 95 % interval [% of the value]",
                type="log",
                tickvals=_TICKS,
                ticktext=[f"{tick:g}" for tick in _TICKS],
            ),
            yaxis=make_axis("", autorange="reversed"),
        )
    )
    return figure


def compute_half_width_percent(value: float | None, std: float | None) -> float | None:
    """Return the half width of the 95 % interval in per cent of the value; None if undefined."""
    return 196.0 * abs(std / value) if value and std else None


def plot_correlation(ids: Sequence[str], correlation: FloatArray) -> Figure:
    """Correlation matrix (n, n) of the estimates; pairs near ±1 are hard to separate.

    A fixed parameter has no correlation and is omitted.
    """
    shown = np.count_nonzero(correlation, axis=0) > 1
    ids = [one for one, kept in zip(ids, shown, strict=True) if kept]
    correlation = correlation[np.ix_(shown, shown)]
    names = [get_parameter_label(one) for one in ids]
    figure = Figure(
        make_trace(
            "heatmap",
            x=names,
            y=names,
            z=correlation,
            zmin=-1,
            zmax=1,
            colorscale=DIVERGING,
            showscale=False,
            texttemplate="%{z:.2f}",
        )
    )
    figure.set_layout(
        make_layout(
            140 + 34 * len(ids), xaxis=make_axis(""), yaxis=make_axis("", autorange="reversed")
        )
    )
    return figure


_INSEPARABLE = (
    "μ and the clutch geometry N·D·A·r: only their product acts.",
    "η and a gain error of the engine torque: only their product acts.",
    "The common scale of all torques rests on the output-torque sensor's gain: an error of it "
    "scales J′, J_vehicle, T_v/i_f, k_o, c_o and μ alike.",
    "J1·η + J2: inertias before and behind the input gear; only this sum acts.",
)
_CLOSE = 0.9
"""Correlation from which a pair is named."""
_LEAST_KNOWN = 5
"""Number of least known parameters listed with a recommended experiment."""


def build_limits_section(found: Identification) -> Section:
    """Build the section on intervals, correlated parameters, and helpful experiments."""
    suggestions = found.evidence.suggestions
    narrower = (
        build_suggestion_blocks(suggestions, found.estimates)
        if suggestions
        else list(_build_uncertainty_tables(found))
    )
    intervals = FigureBlock(
        plot_intervals(found.estimates),
        "Relative 95 % interval of each parameter. Dots: noise, sensor tolerances on the card and "
        "effects that the model leaves out; bars: noise alone.",
    )
    blocks: list[Block] = [intervals, *narrower]
    blocks += make_notes("Not separable from any one shift", _INSEPARABLE)
    if found.correlation is not None:
        blocks += make_notes("Strongly correlated parameters", _list_correlated_pairs(found))
        blocks.append(
            FigureBlock(
                plot_correlation(found.correlation_ids, found.correlation),
                "Correlation of the estimates: near +1 their errors go up and down together, "
                "near −1 one is too high where the other is too low.",
            )
        )
    return Section(
        "limits",
        "Uncertainty and further tests",
        "Limits of the data, and the recordings that would narrow the intervals.",
        blocks,
    )


def build_suggestion_blocks(
    suggestions: Sequence[ExperimentRanking], estimates: Mapping[str, Estimate]
) -> list[Block]:
    """Simulated gain of the best experiment for each parameter, and why others have none."""
    rows: list[tuple[object, ...]] = []
    reasons: dict[str, list[str]] = {}
    for one in suggestions:
        unit, best, number = estimates[one.parameter].unit, one.best, one.best_number
        if best is None:
            reasons.setdefault(one.text, []).append(get_parameter_label(one.parameter))
        if best is None and number is None:
            continue
        experiment = best and Cell(one.text, note=format_half_width(best.half_width, unit))
        known = number and Cell(
            _name_number(number), note=format_half_width(number.share * one.half_width, unit)
        )
        now = format_half_width(one.half_width, unit)
        badge = make_badge(one.verdict.value, TONES[one.verdict])
        rows.append((make_parameter_cell(one.parameter), badge, now, experiment, known))
    columns = (
        "parameter",
        Cell("verdict", secondary=True),
        ("now", "s", "± 95 %"),
        Cell("experiment that would narrow it", note="± 95 % then"),
        Cell("best number to measure", note="± 95 % then"),
    )
    tables = make_tables(
        "Next recordings: each experiment was simulated with this model and the noise of this "
        "log's sensors, and the information it adds gives the interval to expect. A number on the "
        "card that is known exactly takes its share of the variance away.",
        columns,
        rows,
    )
    texts = [f"{', '.join(names)}: {reason}" for reason, names in reasons.items()]
    return [*tables, *make_notes("Not narrowed by an experiment", texts)]


def _name_number(number: CardNumber) -> str:
    is_parameter = number.kind is CardNumberKind.PARAMETER
    return get_parameter_label(number.name) if is_parameter else number.text


def format_half_width(value: float, unit: str) -> str:
    """Format the half width of an interval [SI] with its unit; `open` where infinite."""
    if not isfinite(value):
        return "open"
    display = get_display_unit(unit)
    return f"± {format_significant(value * display.factor, 2)} {display.label}".removesuffix(" –")


def _build_uncertainty_tables(found: Identification) -> Iterator[TableBlock]:
    """The parameters of widest relative interval, and what to record for a narrower one."""
    widths = {
        one.id: compute_half_width_percent(one.value, one.std_total)
        for one in found.estimates.values()
        if one.verdict in (Verdict.IDENTIFIED, Verdict.WEAK) and one.unit != "s"
    }
    ranked = sorted((w, name) for name, w in widths.items() if w is not None)[::-1][:_LEAST_KNOWN]
    if not ranked:
        return
    rows = []
    for width, name in ranked:
        one = found.estimates[name]
        interval = f"± {format_significant(width, 2)} %"
        share, advice = (
            _describe_sensor_share(one),
            get_advice(one.id, one.std_noise or 0.0, one.std_systematic),
        )
        rows.append((make_parameter_cell(name), interval, share, advice))
    columns = (
        "parameter",
        ("interval", "s", "95 %, of the value"),
        ("from sensors and effects", "s", "share of the variance"),
        "what would narrow it",
    )
    yield make_table(
        "The least certain parameters. Experiments cannot narrow the part of an interval that "
        "comes from sensor tolerances and effects.",
        columns,
        rows,
    )


def _describe_sensor_share(one: Estimate) -> str:
    if not one.std_total or one.std_systematic is None:
        return "not stated"
    return f"{100.0 * (one.std_systematic / one.std_total) ** 2:.0f} %"


def _list_correlated_pairs(found: Identification) -> Iterator[str]:
    """Pairs of estimates whose errors go together, in words."""
    ids, matrix = found.correlation_ids, found.correlation
    assert matrix is not None
    for i, one in enumerate(ids):
        for j in range(i + 1, len(ids)):
            if abs(matrix[i, j]) >= _CLOSE:
                number = f"{matrix[i, j]:+z.2f}".replace("-", "−")
                yield f"{get_parameter_label(one)} and {get_parameter_label(ids[j])}: r = {number}."
