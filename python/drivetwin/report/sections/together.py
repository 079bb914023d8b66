# SPDX-License-Identifier: MIT
"""Several logs in one fit, and shifts that were predicted instead of fitted."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from drivetwin._util.display_units import Display, format_significant, get_display_unit
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Estimate
from drivetwin.estimation.result.multi_log import CONSISTENCY, Consistency, LogShare, Several
from drivetwin.estimation.result.validation import HeldOut, Outcome, Validation
from drivetwin.findings import render
from drivetwin.parameters import split_log_number
from drivetwin.report.figures.comparison import plot_agreement
from drivetwin.report.figures.validation import build_validation_panels, plot_validation
from drivetwin.report.find_reports import Candidate, compare_estimates
from drivetwin.report.labels import get_parameter_label
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
    make_cells,
    make_link,
)
from drivetwin.report.sections.comparison import make_value_cell
from drivetwin.report.sections.fits import SIGNALS, build_fit_table, make_fit_cell

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
    separate = [(name, one.alone) for name, one in zip(names, several.logs, strict=True)]
    candidates = [
        Candidate(name, "", {k: v for k, v in alone.items() if k in shared}, {}, {}, {}, "")
        for name, alone in (*separate, (_TOGETHER, shared))
    ]
    compared = [one for one in compare_estimates(candidates) if one.apart is not None]
    blocks: list[Block] = [
        TilesBlock(tiles),
        _build_log_table(found, several),
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


def _build_log_table(found: Identification, several: Several) -> TableBlock:
    """File, shifts, own parameters and fit of each log."""
    own = {name: split_log_number(name) for name in found.estimates}
    plain = list(dict.fromkeys(name for name, number in own.values() if number))
    units = {
        name: get_display_unit(found.estimates[f"{_find_log_id(name, own)}"].unit) for name in plain
    }
    head = (
        *make_cells("log", "file", "shifts"),
        *(Cell(get_parameter_label(n), number=True, note=units[n].label) for n in plain),
        *(Cell(f"fit of {label}", number=True) for label, _ in SIGNALS.values()),
    )
    rows = []
    for one in several.logs:
        mine = {name: key for key, (name, number) in own.items() if number == one.number}
        shifts = ", ".join(f"{shift.start_gear}→{shift.end_gear}" for shift in one.shifts)
        rows.append(
            (
                *make_cells(str(one.number), Path(one.source).name, shifts),
                *(make_value_cell(found.estimates.get(mine.get(n, "")), units[n]) for n in plain),
                *(
                    make_fit_cell(one.fit.get(signal, {}).get("all"), display)
                    for signal, (_, display) in SIGNALS.items()
                ),
            )
        )
    return TableBlock(
        "The logs with their log-specific parameters and the fit of the model.", head, rows
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
        far = move is not None and abs(move.z) > CONSISTENCY.far
        rows.append(
            (
                Cell(get_parameter_label(name), note=name),
                *(make_value_cell(one.alone.get(name), display) for one in logs),
                make_value_cell(estimate, display),
                Cell(display.label),
                Cell("–", number=True)
                if move is None or move.z == 0.0
                else Cell(
                    f"{move.z:+z.1f} σ".replace("-", "−"),
                    number=True,
                    badge=True,
                    tone=Tone.DOUBTFUL if far else Tone.GOOD,
                    note=f"log {move.log}",
                ),
            )
        )
    head = (
        Cell("parameter"),
        *(Cell(f"log {one.number} alone", number=True, note="± 95 % total") for one in logs),
        Cell(_TOGETHER, number=True, note="± 95 % total"),
        Cell("unit"),
        Cell("farthest off", number=True, note="a log against the others"),
    )
    return TableBlock(
        "Shared parameters. Farthest off: the largest deviation of one log from the "
        "others, in standard deviations of noise; doubtful beyond "
        f"{CONSISTENCY.far:g}.",
        head,
        rows,
    )


def build_holdout_section(found: Identification, held: Sequence[HeldOut]) -> Section:
    """Compare the fit of each predicted shift with the fitted shifts and the noise limit."""
    tiles = [
        Tile(one.name, _format_torque_fit(one), _TONES[one.outcome], one.outcome.value)
        for one in held
    ]
    blocks: list[Block] = [TilesBlock(tiles), _build_judgement_table(found, held)]
    own = list(_iterate_log_rows(held))
    if own:
        head = (
            Cell("log"),
            Cell("parameter"),
            Cell("value", number=True),
            *make_cells("unit", "from"),
        )
        text = "Log-specific parameters, from the gear held before the shift."
        blocks.append(TableBlock(text, head, own))
    notes = [f"{one.name}: {text}" for one in held for text in render(one.findings)]
    if notes:
        blocks.append(NotesBlock("About the predictions", notes, Tone.DOUBTFUL))
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


def _build_judgement_table(found: Identification, held: Sequence[HeldOut]) -> TableBlock:
    head = (
        *make_cells("shift", "signal"),
        Cell("predicted", number=True, note="fit %, rmse"),
        Cell("fitted", number=True, note="fit %, rmse"),
        Cell("usual", number=True, note="rmse", secondary=True),
        Cell("allowed", number=True, note="rmse"),
        *make_cells("unit", "verdict"),
    )
    rows = []
    for one in held:
        fits = {} if one.validation is None else one.validation.fit
        for signal, phases in fits.items():
            label, display = SIGNALS[signal]
            bound, outcome = one.bounds.get(signal), one.get_signal_outcome(signal)
            usual, allowed = (None, None) if bound is None else (bound.usual, bound.largest)
            rows.append(
                (
                    *make_cells(one.name, label),
                    make_fit_cell(phases["all"], display),
                    make_fit_cell(found.fit.get(signal, {}).get("all"), display),
                    _make_bound_cell(usual, display, secondary=True),
                    _make_bound_cell(allowed, display),
                    Cell(display.label),
                    Cell(outcome.value, badge=True, tone=_TONES[outcome]),
                )
            )
        if not fits:
            dash, minor = Cell("–", number=True), Cell("–", number=True, secondary=True)
            verdict = Cell(one.outcome.value, badge=True, tone=_TONES[one.outcome])
            rows.append((*make_cells(one.name, ""), dash, dash, minor, dash, Cell(""), verdict))
    return TableBlock(
        "Errors of the predictions, of the fitted shifts, and the limit set by noise.",
        head,
        rows,
    )


def _make_bound_cell(size: float | None, display: Display, *, secondary: bool = False) -> Cell:
    text = "–" if size is None else format_significant(size * display.factor, 3)
    return Cell(text, number=True, secondary=secondary)


def _iterate_log_rows(held: Sequence[HeldOut]) -> Iterator[tuple[Cell, ...]]:
    for one in held:
        for name, estimate in one.own.items():
            display = get_display_unit(estimate.unit)
            yield (
                Cell(Path(one.source).name),
                Cell(get_parameter_label(name), note=name),
                make_value_cell(estimate, display),
                Cell(display.label),
                Cell(estimate.method),
            )


def _build_prediction_blocks(one: HeldOut, run: Validation) -> Iterator[Block]:
    """Simulation over measurement of one prediction, and its fit by phase."""
    yield FigureBlock(
        plot_validation(run),
        f"{one.name}, predicted: measured inputs, each output as measured and as predicted, "
        "and the residual below.",
        build_validation_panels(run),
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
