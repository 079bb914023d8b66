# SPDX-License-Identifier: MIT
"""Several logs in one fit, predicted shifts, and several identifications side by side."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from drivetwin._util.display_units import Display, format_significant, get_display_unit
from drivetwin.estimation.identification import (
    CONSISTENCY,
    Consistency,
    Identification,
    LogPull,
    LogShare,
    Several,
)
from drivetwin.estimation.result.estimate import Z95, Estimate, FrictionCurve
from drivetwin.estimation.result.validation import HeldOut, Outcome, Validation
from drivetwin.findings import render
from drivetwin.parameters import split_log_number
from drivetwin.report.blocks import (
    Block,
    Cell,
    Column,
    FigureBlock,
    Section,
    TableBlock,
    Tile,
    TilesBlock,
    Tone,
    make_badge,
    make_link,
    make_notes,
    make_number,
    make_table,
    make_tables,
)
from drivetwin.report.figure import (
    MUTED,
    Figure,
    get_candidate_style,
    get_channel_display,
    get_channel_label,
    get_estimate_label,
    get_parameter_label,
    make_axis,
    make_layout,
    make_trace,
)
from drivetwin.report.find_reports import Agreement, Trial, compare_estimates
from drivetwin.report.parameters import make_parameter_cell, make_value_cell
from drivetwin.report.stack import Curve, Panel, stack_panels
from drivetwin.report.summary import build_fit_table, make_fit_cell
from drivetwin.report.validation import OUTPUTS, draw_band, plot_validation
from drivetwin.validation.simulate_log import SIGNALS

_TONES = {
    Outcome.ALLOWED: Tone.GOOD,
    Outcome.WORSE: Tone.DOUBTFUL,
    Outcome.NOT_JUDGED: Tone.UNKNOWN,
    Outcome.NOT_PREDICTED: Tone.DOUBTFUL,
}
_TOGETHER = "together"


def build_joint_section(found: Identification, several: Several) -> Section:
    """Compare the estimates of each log with the joint estimate, and test their agreement."""
    tested = several.consistency
    tone = Tone.GOOD if tested.agree else Tone.DOUBTFUL
    word = "agree" if tested.agree else "disagree"
    tiles = [
        Tile("logs fitted as one", str(len(several.logs))),
        Tile("the logs", word, tone, f"χ² {tested.chi2:.1f} on {tested.freedom}, p {tested.p:.2g}"),
    ]
    shared = {k: one for k, one in found.estimates.items() if not split_log_number(k)[1]}
    names = [f"log {one.number}" for one in several.logs]
    alone = [{k: v for k, v in one.alone.items() if k in shared} for one in several.logs]
    compared = [one for one in compare_estimates([*alone, shared]) if one.apart is not None]
    blocks: list[Block] = [
        TilesBlock(tiles),
        build_log_table(found, several),
        _build_shared_table(shared, several.logs, tested),
        FigureBlock(
            plot_agreement([*names, _TOGETHER], compared),
            "Values of each log alone and of all together, relative to their common mean, "
            "with total 95 % intervals in standard deviations of the parameter. Averaging n logs "
            "with similar excitation narrows the part from noise by √n; the part from sensor "
            "tolerances remains, because it is the same in all logs.",
        ),
    ]
    return Section(
        "logs",
        "The logs together",
        f"{tested.text} Driveline parameters are shared; load and engine-torque delay are specific "
        "to each log. A design value counts once.",
        blocks,
    )


def build_log_table(found: Identification, several: Several) -> TableBlock:
    """File, shifts, own parameters and fit of each log."""
    own = {name: split_log_number(name) for name in found.estimates}
    plain = list(dict.fromkeys(name for name, number in own.values() if number))
    units = {
        name: get_display_unit(found.estimates[_find_log_id(name, own)].unit) for name in plain
    }
    rows = []
    for one in several.logs:
        mine = {name: key for key, (name, number) in own.items() if number == one.number}
        shifts = ", ".join(shift.name for shift in one.shifts)
        values = (make_value_cell(found.estimates.get(mine.get(n, "")), units[n]) for n in plain)
        fits = (make_fit_cell(one.fit.get(signal, {}).get("all"), signal) for signal in SIGNALS)
        rows.append((str(one.number), Path(one.source).name, shifts, *values, *fits))
    columns: Sequence[Column] = (
        *("log", "file", "shifts"),
        *(make_number(get_parameter_label(n), units[n].label) for n in plain),
        *(make_number(f"fit of {get_channel_label(signal)}") for signal in SIGNALS),
    )
    return make_table(
        "The logs with their log-specific parameters and the fit of the model.", columns, rows
    )


def _find_log_id(plain: str, own: dict[str, tuple[str, int]]) -> str:
    """Return the first log-specific id of the parameter `plain`."""
    return next(key for key, (name, number) in own.items() if name == plain and number)


def _build_shared_table(
    shared: dict[str, Estimate], logs: Sequence[LogShare], tested: Consistency
) -> TableBlock:
    """Every parameter that the logs share: alone, together, and the log farthest off."""
    moves = {one.parameter: one for one in tested.moves}
    rows = []
    for name, estimate in shared.items():
        display, move = get_display_unit(estimate.unit), moves.get(name)
        alone = (make_value_cell(one.alone.get(name), display) for one in logs)
        value = make_value_cell(estimate, display)
        off = None if move is None or move.z == 0.0 else _make_pull_cell(move)
        rows.append((make_parameter_cell(name), *alone, value, display.label, off))
    columns: Sequence[Column] = (
        "parameter",
        *(make_number(f"log {one.number} alone", "± 95 % total") for one in logs),
        make_number(_TOGETHER, "± 95 % total"),
        "unit",
        make_number("farthest off", "a log against the others"),
    )
    return make_table(
        "Shared parameters. Farthest off: the largest deviation of one log from the "
        "others, in standard deviations of noise; doubtful beyond "
        f"{CONSISTENCY.far:g}.",
        columns,
        rows,
    )


def _make_pull_cell(pull: LogPull) -> Cell:
    """Make the cell of the log that is farthest off."""
    tone = Tone.DOUBTFUL if abs(pull.z) > CONSISTENCY.far else Tone.GOOD
    text = f"{pull.z:+z.1f} σ".replace("-", "−")
    return Cell(text, number=True, badge=True, tone=tone, note=f"log {pull.log}")


def build_holdout_section(found: Identification, held: Sequence[HeldOut]) -> Section:
    """Compare the fit of each predicted shift with the fitted shifts and the noise limit."""
    tiles = [
        Tile(one.name, _format_torque_fit(one), _TONES[one.outcome], one.outcome.value)
        for one in held
    ]
    blocks: list[Block] = [TilesBlock(tiles), *build_judgement_blocks(found, held)]
    for one in held:
        if one.validation is not None:
            blocks += [*_build_prediction_blocks(one, one.validation)]
    return Section(
        "held-out",
        "Predicted, not fitted",
        "These shifts took no part in the fit. The identified model is driven by their measured "
        "engine torque and pressures. The start state, and for a log that was not fitted its "
        "load and engine-torque delay, come from the gear held before the shift; simulations of "
        "fitted shifts start from a state that is estimated from a few samples. Allowed: the 97.5 "
        "% limit of the error of a correct model, from the noise of inputs and sensors and the "
        "uncertainty of the parameters.",
        blocks,
    )


def _format_torque_fit(one: HeldOut) -> str:
    """Fit % of the output torque, else of the input speed."""
    if one.validation is None:
        return "–"
    fits = one.validation.fit
    return f"{next(iter(fits.values()))['all'].fit_percent:z.1f} %"


def build_judgement_blocks(found: Identification, held: Sequence[HeldOut]) -> list[Block]:
    """Errors of the predictions, parameters of logs that were not fitted, and remarks."""
    blocks: list[Block] = [_build_judgement_table(found, held)]
    text = "Log-specific parameters, from the gear held before the shift."
    columns = ("log", "parameter", ("value", "s"), "unit", "from")
    blocks += make_tables(text, columns, _iterate_log_rows(held))
    notes = [f"{one.name}: {text}" for one in held for text in render(one.findings)]
    return [*blocks, *make_notes("About the predictions", notes, Tone.DOUBTFUL)]


def _build_judgement_table(found: Identification, held: Sequence[HeldOut]) -> TableBlock:
    """Errors of the predictions beside those of the fitted shifts and the limit set by noise."""
    columns = (
        *("shift", "signal"),
        ("predicted", "s", "fit %, rmse"),
        ("fitted", "s", "fit %, rmse"),
        make_number("usual", "rmse", secondary=True),
        ("allowed", "s", "rmse"),
        *("unit", "verdict"),
    )
    rows: list[Sequence[object]] = []
    for one in held:
        fits = {} if one.validation is None else one.validation.fit
        for signal, phases in fits.items():
            display, bound = get_channel_display(signal), one.bounds.get(signal)
            bounds = (None, None) if bound is None else (bound.usual, bound.largest)
            outcome = one.get_signal_outcome(signal)
            rows.append(
                (
                    *(one.name, get_channel_label(signal)),
                    make_fit_cell(phases["all"], signal),
                    make_fit_cell(found.fit.get(signal, {}).get("all"), signal),
                    *(_format_bound(size, display) for size in bounds),
                    display.label,
                    make_badge(outcome.value, _TONES[outcome]),
                )
            )
        if not fits:
            verdict = make_badge(one.outcome.value, _TONES[one.outcome])
            rows.append((one.name, "", None, None, None, None, "", verdict))
    return make_table(
        "Errors of the predictions, of the fitted shifts, and the limit set by noise.",
        columns,
        rows,
    )


def _format_bound(size: float | None, display: Display) -> str:
    return "–" if size is None else format_significant(size * display.factor, 3)


def _iterate_log_rows(held: Sequence[HeldOut]) -> Iterator[tuple[object, ...]]:
    for one in held:
        for name, estimate in one.own.items():
            display, file = get_display_unit(estimate.unit), Path(one.source).name
            value = make_value_cell(estimate, display)
            yield file, make_parameter_cell(name), value, display.label, estimate.method


def _build_prediction_blocks(one: HeldOut, run: Validation) -> Iterator[Block]:
    """Simulation over measurement of one prediction, and its fit by phase."""
    yield FigureBlock(
        plot_validation(run),
        f"{one.name}, predicted: measured inputs, each output as measured and as predicted, "
        "and the residual below.",
        make_link(one.shift),
    )
    yield build_fit_table(run.fit, f"Fit % and rmse of the prediction by phase, {one.name}.")


def prefix_log_section(section: Section, share: LogShare) -> Section:
    """A section of a one-log report under the number of its log."""
    return replace(
        section,
        anchor=f"{section.anchor}-{share.number}",
        title=f"{section.title}: log {share.number}, {Path(share.source).name}",
    )


_ROW = 0.7
"""Share of the height of a row that the candidates of one parameter take up."""


def plot_agreement(names: Sequence[str], found: Sequence[Agreement]) -> Figure:
    """Deviation of each candidate from the common mean, with 95 % intervals, by parameter.

    In standard deviations of the parameter (the median of the candidates'), so that narrow and wide
    ones read alike. Parameters that cannot be judged are left out; `names` are the candidates'.
    """
    shown = [one for one in found if one.apart is not None]
    figure = Figure()
    for k, name in enumerate(names):
        style = get_candidate_style(k)
        points = [
            (row + _ROW * ((k + 0.5) / len(names) - 0.5), *_standardise(one, k), one)
            for row, one in enumerate(shown)
            if (estimate := one.estimates[k]) is not None and estimate.value is not None
        ]
        figure.add_scatter(
            x=[deviation for _, deviation, _, _ in points],
            y=[row for row, _, _, _ in points],
            error_x={
                "array": [half for _, _, half, _ in points],
                "thickness": 1.6,
                "width": 4,
                "color": style.colour,
            },
            mode="markers",
            name=name,
            text=[get_estimate_label(one.known) for _, _, _, one in points],
            marker={"color": style.colour, "symbol": style.symbol, "size": 9},
            hovertemplate="%{text}: %{x:+.2f} σ<extra>" + name + "</extra>",
        )
    ticks = {
        "tickvals": list(range(len(shown))),
        "ticktext": [get_estimate_label(one.known) for one in shown],
        "range": [len(shown) - 0.4, -0.6],
    }
    figure.set_layout(
        make_layout(
            120 + (18 + 12 * len(names)) * len(shown),
            xaxis=make_axis("deviation from the common mean, with 95 % interval [σ]"),
            yaxis=make_axis("", **ticks),
        )
    )
    figure.add_vline(x=0.0, line={"color": "rgba(128,128,128,0.7)", "width": 1})
    return figure


def _standardise(one: Agreement, k: int) -> tuple[float, float]:
    """Deviation of the `k`-th value from the mean and its 95 % half width, over the median σ."""
    stds = [each.std_total for each in one.estimates if each is not None and each.std_total]
    unit = float(np.median(stds))
    estimate = one.estimates[k]
    assert estimate is not None
    assert estimate.value is not None
    return (estimate.value - one.mean) / unit, Z95 * (estimate.std_total or 0.0) / unit


def plot_friction_overlay(
    element: str, curves: Mapping[str, FrictionCurve], order: Sequence[str]
) -> Figure:
    """μ over slip of one element as each candidate has it, with 95 % bands.

    `curves` by name of the candidate; `order` are all candidates, which gives each its colour.
    """
    figure = Figure()
    for name, curve in curves.items():
        style = get_candidate_style(order.index(name))
        figure.add_trace(draw_band(curve, style.fill, legendgroup=name, showlegend=False))
        figure.add_scatter(
            x=curve.slip,
            y=curve.mu,
            mode="lines",
            name=f"{name} ({curve.symbol})" if curve.over_eta else name,
            legendgroup=name,
            line={"color": style.colour, "width": 2.0, "dash": style.dash},
        )
    figure.set_layout(
        make_layout(
            400,
            xaxis=make_axis(f"|slip| of {element} [rad/s]", rangemode="tozero"),
            yaxis=make_axis("friction coefficient μ [–]"),
            hovermode="x",
        )
    )
    return figure


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


def plot_fit_matrix(
    rows: Sequence[str], columns: Sequence[str], percent: Sequence[Sequence[float | None]]
) -> Figure:
    """Fit [%] of the output torque: candidates over the logs that they simulate."""
    figure = Figure(
        make_trace(
            "heatmap",
            x=list(columns),
            y=list(rows),
            z=[[np.nan if value is None else value for value in row] for row in percent],
            text=[["–" if value is None else f"{value:z.1f}" for value in row] for row in percent],
            texttemplate="%{text}",
            zmin=0.0,
            zmax=100.0,
            colorscale=[[0.0, "#f4f4f4"], [1.0, "#0072B2"]],
            showscale=False,
            hovertemplate="%{y} on %{x}: %{text} %<extra></extra>",
        )
    )
    figure.set_layout(
        make_layout(
            130 + 34 * len(rows),
            xaxis=make_axis("log and shift", ticks="", side="top"),
            yaxis=make_axis("", ticks="", autorange="reversed"),
        )
    )
    return figure
