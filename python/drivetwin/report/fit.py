# SPDX-License-Identifier: MIT
"""Fit of a network as one HTML page that opens offline."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from drivetwin._util.display_units import (
    RPM,
    Display,
    format_significant,
    format_uncertainty,
    get_display_unit,
    scale_display,
)
from drivetwin.channels.roles import Quantity
from drivetwin.estimation.result.estimate import Z95
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.findings import Finding
from drivetwin.fit.fit import HeldOut
from drivetwin.fit.places import find_input_quantity, get_output_quantity
from drivetwin.fit.plant import NetworkTerm
from drivetwin.fit.result import ModelFit, MovedNumber
from drivetwin.likelihood.output import SignalFit
from drivetwin.likelihood.point import ParameterVector
from drivetwin.report.blocks import (
    Block,
    Cell,
    FigureBlock,
    Page,
    Section,
    TableBlock,
    TextBlock,
    VerdictBlock,
    build_findings_section,
    make_table,
)
from drivetwin.report.figure import MEASURED, MUTED, OVER, SIMULATED, UNDER, Figure
from drivetwin.report.model_verdict import ModelVerdict, build_verdict_block
from drivetwin.report.parameters import build_parameter_blocks
from drivetwin.report.stack import Curve, Panel, plot_over_time_axis
from drivetwin.simulation.network import NetworkRun, Output

_HEIGHT = 190
"""Height of a panel [px]."""
_WIDENS = 0.01
"""Share in the variance of an unknown from which a fixed number is listed [ratio]."""
_ACTIONS = {
    ModelStatus.VALID: "Use the values and the fitted model.",
    ModelStatus.LIMITED: "Use the identified values; see the findings for the others.",
    ModelStatus.NOT_VALID: "Compare simulation and recording, and correct the model.",
    ModelStatus.NOT_VALIDATED: "Compare simulation and recording.",
}


def build_fit_page(
    found: ModelFit,
    logs: Sequence[str],
    held_out: Mapping[str, HeldOut],
    remarks: Sequence[Finding] = (),
) -> Page:
    """Build the page."""
    terms = zip(logs, found.problem.terms, found.simulate(), strict=True)
    point = found.minimum.point
    verdict = build_fit_verdict(found.status, found.chi2)
    figures = [FigureBlock(plot_recording(term, point, run), f"{log}.") for log, term, run in terms]
    sections = [
        Section("result", "Result", "", [verdict, *_build_parameters(found)]),
        build_findings_section((*remarks, *found.findings)),
        Section(
            "recordings",
            "Recordings",
            "Measured and simulated quantities, driven by the measured inputs.",
            [*figures, _build_agreement_table(found, logs, held_out)],
        ),
        Section(
            "search",
            "Search",
            "Starts from the screen of draws, and the minima that they led to.",
            [_build_start_table(found)],
        ),
    ]
    subtitle = f"{found.problem.size} samples · Q per sample {found.chi2:.3f}"
    return Page(f"{found.model.name}: fit of {', '.join(logs)}", subtitle, sections)


def build_fit_blocks(
    found: ModelFit,
    logs: Sequence[str],
    held_out: Mapping[str, HeldOut],
    remarks: Sequence[Finding] = (),
) -> list[Block]:
    """Verdict, parameters, agreement with the recordings, minima of the search, and findings."""
    return [
        build_fit_verdict(found.status, found.chi2),
        *_build_parameters(found),
        _build_agreement_table(found, logs, held_out),
        _build_start_table(found),
        *build_findings_section((*remarks, *found.findings)).blocks,
    ]


def build_prediction_blocks(found: HeldOut, log: str) -> list[Block]:
    """Build the agreement of a prediction with the recording."""
    size = format_significant(found.chi2, 3)
    outputs = found.term.plant.outputs
    return [
        TextBlock(f"The mean squared residual is {size} of the noise."),
        _tabulate_agreement(outputs, {log: found.agreement}),
    ]


def build_prediction_page(found: HeldOut, model: str, log: str) -> Page:
    """Build the page of a recording that a fitted model predicts."""
    figure = plot_recording(found.term, found.point, found.term.build_task(found.point).simulate())
    blocks = [*build_prediction_blocks(found, log), FigureBlock(figure, f"{log}.")]
    section = Section("recordings", "Recording", "Measured and simulated quantities.", blocks)
    return Page(f"{model}: simulation of {log}", "by the values of a fit", [section])


def build_fit_verdict(status: ModelStatus, chi2: float) -> VerdictBlock:
    """Build the verdict on a fit from its status and Q per sample."""
    reason = f"The mean squared residual is {format_significant(chi2, 3)} of the noise."
    return build_verdict_block(ModelVerdict(status, reason, _ACTIONS[status]))


def _build_parameters(found: ModelFit) -> list[Block]:
    count = len(found.sought)
    blocks = build_parameter_blocks(found.estimates, f"{count} unknowns of the model.")
    return [*blocks, *_build_fixed_table(found)]


def _build_fixed_table(found: ModelFit) -> list[TableBlock]:
    """Build the table of the numbers beside the unknowns that widen an interval."""
    shown = [one for one in found.moved if one.share >= _WIDENS or one.finding is not None]
    if not shown:
        return []
    columns = (
        "fixed number",
        ("stated ± 95 %", "s"),
        ("with the recordings", "s"),
        "unit",
        "tolerance",
        Cell("widens most (share of the variance)", secondary=True),
    )
    title = "Numbers of the model that are no unknowns, and widen intervals"
    return [make_table(title, columns, map(_build_fixed_row, shown))]


def _build_fixed_row(one: MovedNumber) -> tuple[str, ...]:
    number = one.number
    display = scale_display(get_display_unit(number.unit or "1"), number.value)
    texts = [
        " ± ".join(format_uncertainty(value * display.factor, Z95 * std * display.factor))
        for value, std in ((number.value, number.std), (one.value, one.std))
    ]
    widened = f"{one.widens} ({100.0 * one.share:.0f} %)"
    return number.name, *texts, display.label, str(number.source), widened


def plot_recording(term: NetworkTerm, point: ParameterVector, run: NetworkRun) -> Figure:
    """Draw the outputs of a recording, measured and simulated, and the inputs below."""
    panels = []
    shown = term.show(point, run.columns)
    for out in term.record.outputs:
        output = term.plant.outputs[out.name]
        curves = [
            Curve("simulated", run.time, shown[out.name], SIMULATED, UNDER),
            Curve("measured", term.record.time[out.place], out.values, MEASURED, OVER),
        ]
        panels.append(Panel(out.name, _get_display(get_output_quantity(output)), curves))
    for name, signal in term.record.inputs.items():
        curve = Curve("input", signal.time, signal.values, MUTED)
        quantity = find_input_quantity(name, term.plant.elements)
        panels.append(Panel(name, _get_display(quantity), [curve], weight=0.6))
    view = (float(run.time[0]), float(run.time[-1]))
    return plot_over_time_axis(panels, view, _HEIGHT * len(panels))


def _get_display(quantity: Quantity) -> Display:
    return RPM if quantity is Quantity.SPEED else get_display_unit(quantity.unit)


def _build_agreement_table(
    found: ModelFit, logs: Sequence[str], held_out: Mapping[str, HeldOut]
) -> TableBlock:
    agreement = dict(zip(logs, found.agreement, strict=True))
    agreement |= {f"{name}, held out": one.agreement for name, one in held_out.items()}
    return _tabulate_agreement(found.problem.terms[0].plant.outputs, agreement)


def _tabulate_agreement(
    outputs: Mapping[str, Output], agreement: Mapping[str, Mapping[str, SignalFit]]
) -> TableBlock:
    displays = {name: _get_display(get_output_quantity(one)) for name, one in outputs.items()}
    rows = [
        (log, name, one.fit_percent, one.rmse * displays[name].factor, displays[name].label)
        for log, fits in agreement.items()
        for name, one in fits.items()
    ]
    columns = ("log", "output", ("fit %", ".1f"), ("rmse", "3"), "unit")
    return make_table("Agreement of simulation and measurement", columns, rows)


def _build_start_table(found: ModelFit) -> TableBlock:
    best = min(one.cost for one in found.starts)
    rows = []
    for number, start in enumerate(found.starts, start=1):
        texts = [
            f"{one.name} {format_uncertainty(one.to_value(start.point[one.name]), None)[0]}"
            for one in found.sought[:4]
        ]
        rows.append((str(number), start.cost - best, start.iterations, ", ".join(texts)))
    values = "first value" if len(found.sought) == 1 else "first values"
    columns = ("start", ("cost above best", ".2f"), ("iterations", "d"))
    return make_table(
        f"{found.agreeing} of {len(found.starts)} starts led to the best minimum",
        (*columns, Cell(values, secondary=True)),
        rows,
    )
