# SPDX-License-Identifier: MIT
"""Identifiability: parameters that a log cannot determine, and experiments that would help."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite

from drivetwin._util.display_units import Display, format_significant, get_display_unit
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.estimation.result.suggestion import CardNumber, CardNumberKind, ExperimentRanking
from drivetwin.estimation.result.verdict import get_advice
from drivetwin.report.figures.parameters import (
    compute_half_width_percent,
    plot_correlation,
    plot_intervals,
)
from drivetwin.report.labels import get_parameter_label
from drivetwin.report.sections.blocks import (
    Block,
    Cell,
    FigureBlock,
    NotesBlock,
    Section,
    TableBlock,
    make_cells,
)
from drivetwin.report.sections.parameters import TONES

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
        _build_suggestion_tables(suggestions, found)
        if suggestions
        else _build_uncertainty_tables(found)
    )
    intervals = FigureBlock(
        plot_intervals(found.estimates),
        "Relative 95 % interval of each parameter. Dots: noise, sensor tolerances on the card and "
        "effects that the model leaves out; bars: noise alone.",
    )
    blocks: list[Block] = [intervals, *narrower]
    blocks.append(NotesBlock("Not separable from any one shift", _INSEPARABLE))
    if found.correlation is not None:
        pairs = list(_list_correlated_pairs(found))
        if pairs:
            blocks.append(NotesBlock("Strongly correlated parameters", pairs))
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


def _build_suggestion_tables(
    suggestions: Sequence[ExperimentRanking], found: Identification
) -> Iterator[TableBlock]:
    """Tabulate the simulated gain of the best experiment for each uncertain parameter."""
    rows = []
    for one in suggestions:
        display = get_display_unit(found.estimates[one.parameter].unit)
        then = None if one.best is None else one.best.half_width
        number = one.best_number
        known = None if number is None else number.share * one.half_width
        rows.append(
            (
                Cell(get_parameter_label(one.parameter)),
                Cell(one.verdict.value, badge=True, tone=TONES[one.verdict]),
                Cell(_format_half_width(one.half_width, display), number=True),
                Cell(one.text),
                Cell("–" if then is None else _format_half_width(then, display), number=True),
                Cell("–" if number is None else _name_number(number)),
                Cell("–" if known is None else _format_half_width(known, display), number=True),
            )
        )
    head = (
        *make_cells("parameter", "verdict"),
        Cell("now", number=True, note="± 95 %"),
        Cell("experiment that would narrow it"),
        Cell("then", number=True, note="± 95 %, to expect"),
        Cell("number that would narrow it if exact on the card"),
        Cell("then", number=True, note="± 95 %, to expect"),
    )
    yield TableBlock(
        "Next recordings: each experiment was simulated with this model and the noise of this "
        "log's sensors, and the information it adds gives the interval to expect. A number on the "
        "card that is known exactly takes its share of the variance away.",
        head,
        rows,
    )


def _name_number(number: CardNumber) -> str:
    is_parameter = number.kind is CardNumberKind.PARAMETER
    return get_parameter_label(number.name) if is_parameter else number.text


def _format_half_width(value: float, display: Display) -> str:
    if not isfinite(value):
        return "open"
    return f"± {format_significant(value * display.factor, 2)} {display.label}".removesuffix(" –")


def _build_uncertainty_tables(found: Identification) -> Iterator[TableBlock]:
    """The parameters of widest relative interval, and what to record for a narrower one."""
    widths = {
        one.id: compute_half_width_percent(one.value, one.std_total)
        for one in found.estimates.values()
        if one.verdict in (Verdict.IDENTIFIED, Verdict.WEAK) and one.unit != "s"
    }
    ranked = sorted((w, name) for name, w in widths.items() if w is not None)[::-1][:_LEAST_KNOWN]
    if ranked:
        rows = [
            (
                Cell(get_parameter_label(name)),
                Cell(f"± {format_significant(width, 2)} %", number=True),
                Cell(_describe_sensor_share(found.estimates[name]), number=True),
                Cell(_write_advice(found.estimates[name])),
            )
            for width, name in ranked
        ]
        head = (
            Cell("parameter"),
            Cell("interval", number=True, note="95 %, of the value"),
            Cell("from sensors and effects", number=True, note="share of the variance"),
            Cell("what would narrow it"),
        )
        yield TableBlock(
            "The least certain parameters. Experiments cannot narrow the part of an interval that "
            "comes from sensor tolerances and effects.",
            head,
            rows,
        )


def _write_advice(one: Estimate) -> str:
    return get_advice(one.id, one.std_noise or 0.0, one.std_systematic)


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
