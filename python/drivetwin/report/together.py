# SPDX-License-Identifier: MIT
"""Several logs in one fit, predicted shifts, and friction of several identifications."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from drivetwin._util.display_units import Display, format_significant, get_display_unit
from drivetwin.estimation.identification import (
    CONSISTENCY,
    Consistency,
    Identification,
    LogPull,
    LogShare,
    Several,
)
from drivetwin.estimation.result.estimate import Estimate, FrictionCurve
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
    Figure,
    get_candidate_style,
    get_channel_display,
    get_channel_label,
    get_parameter_label,
    make_axis,
    make_layout,
)
from drivetwin.report.parameters import make_parameter_cell, make_value_cell
from drivetwin.report.summary import build_fit_table, make_fit_cell
from drivetwin.report.validation import draw_band, plot_validation
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
    blocks: list[Block] = [
        TilesBlock(tiles),
        build_log_table(found, several),
        _build_shared_table(shared, several.logs, tested),
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
