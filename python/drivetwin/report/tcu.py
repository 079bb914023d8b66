# SPDX-License-Identifier: MIT
"""Plant from logs of a gearbox control as blocks: for page and terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from drivetwin._util.display_units import RPM
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.report.blocks import (
    Block,
    FigureBlock,
    Page,
    Section,
    TableBlock,
    Tone,
    VerdictBlock,
    make_notes,
    make_table,
)
from drivetwin.report.figure import Figure
from drivetwin.report.figures.stack import Curve, Panel, plot_over_time_axis
from drivetwin.report.model_verdict import ModelVerdict, build_verdict_block
from drivetwin.report.sections.parameters import build_parameter_blocks
from drivetwin.report.style import BAND, MEASURED, OVER, SIMULATED, UNDER
from drivetwin.tcu.log import SPEEDS
from drivetwin.tcu.outcome import TcuIdentification
from drivetwin.tcu.predict import PredictedShift

_HEIGHT = 190
"""Height of a panel [px]."""
_ACTIONS = {
    ModelStatus.VALID: "Predict shifts of the kinds that were fitted: 'drivetwin simulate'.",
    ModelStatus.LIMITED: "Compare the speeds of the held-out shifts before the plant is used.",
    ModelStatus.NOT_VALID: "Correct the card, and identify again.",
    ModelStatus.NOT_VALIDATED: "Predict a log that was not fitted: 'drivetwin simulate'.",
}


def build_tcu_page(found: TcuIdentification) -> Page:
    """Build the page."""
    names = ", ".join(Path(one.source).name for one in found.logs)
    shown = len(found.found.shifts), len(found.predictions)
    subtitle = f"{shown[0]} shifts fitted · {shown[1]} held out"
    return Page(f"Gearbox control: {names}", subtitle, build_tcu_sections(found))


def build_predictions_page(predictions: Sequence[PredictedShift], log: str) -> Page:
    """Build the page of predicted shifts of a log."""
    blocks = [build_prediction_table(predictions), *build_prediction_figures(predictions)]
    return Page(f"Predicted shifts: {log}", "", [Section("shifts", "Shifts", "", blocks)])


def build_tcu_sections(found: TcuIdentification) -> list[Section]:
    """Build the sections of a result: verdict, quantities, held-out shifts."""
    figures = build_prediction_figures(found.predictions)
    sections = [
        Section("result", "Result", "", _build_result(found)),
        Section(
            "held-out",
            "Held-out shifts",
            "Predicted from commands, bus torque and the rows before the change of the commanded "
            "gear. The band contains 95 % of the rows.",
            [build_prediction_table(found.predictions), *figures],
        ),
    ]
    return [one for one in sections if one.blocks]


def build_tcu_blocks(found: TcuIdentification) -> list[Block]:
    """Build the blocks of the terminal."""
    return [*_build_result(found), build_prediction_table(found.predictions)]


def explain_tcu(status: ModelStatus, reason: str) -> VerdictBlock:
    """Build the verdict on a plant."""
    return build_verdict_block(ModelVerdict(status, reason, _ACTIONS[status]))


def _build_result(found: TcuIdentification) -> list[Block]:
    left_out = [text for one in found.logs for text in one.left_out]
    return [
        explain_tcu(found.status, found.reason),
        *build_parameter_blocks(found.estimates),
        *make_notes("Shifts that were left out", left_out, Tone.DOUBTFUL),
    ]


def build_prediction_table(predictions: Sequence[PredictedShift]) -> TableBlock:
    """Build the table of predicted shifts."""
    rows = [
        (
            one.shift.name,
            *(RPM.to_display(one.rms)).tolist(),
            100.0 * float(one.inside.mean()),
            one.times.duration,
            one.duration_band,
            one.measured.duration,
        )
        for one in predictions
    ]
    columns = (
        "shift",
        ("engine rms [rpm]", ".1f"),
        ("turbine", ".1f"),
        ("output", ".1f"),
        ("rows in band [%]", ".0f"),
        ("slip [s]", ".3f"),
        ("± 95 %", ".3f"),
        ("measured [s]", ".3f"),
    )
    return make_table(f"{len(rows)} predicted shifts", columns, rows)


def build_prediction_figures(predictions: Sequence[PredictedShift]) -> list[Block]:
    """Draw the speeds of predicted shifts with their bands."""
    return [
        FigureBlock(_plot_prediction(one), f"{one.shift.name}, at {one.shift.begin:.2f} s.")
        for one in predictions
    ]


def _plot_prediction(one: PredictedShift) -> Figure:
    time, panels = one.shift.time, []
    for k, role in enumerate(SPEEDS):
        middle, half = one.speeds[:, k], one.band[:, k]
        curves = [
            Curve("band", time, middle - half, BAND, 0.0, listed=False),
            Curve("95 % band", time, middle + half, BAND, 0.0, fill=BAND),
            Curve("predicted", time, middle, SIMULATED, UNDER),
            Curve("measured", time, one.shift.speeds[:, k], MEASURED, OVER),
        ]
        panels.append(Panel(role.replace("_", " "), RPM, curves))
    return plot_over_time_axis(panels, (float(time[0]), float(time[-1])), 3 * _HEIGHT)
