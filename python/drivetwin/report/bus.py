# SPDX-License-Identifier: MIT
"""Result of bus logs or of a gearbox control as blocks: for page, terminal and notebook."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from drivetwin._util.display_units import RPM, format_uncertainty
from drivetwin.bus.decay import DECAY, DecayPrediction, JointDecay
from drivetwin.bus.identify import BusIdentification, identify_bus
from drivetwin.bus.phases import Timeline
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import InputError
from drivetwin.estimation.direct.ringdown import RING_DOWN
from drivetwin.estimation.result.estimate import Z95, Estimate, Verdict
from drivetwin.estimation.result.method import ModelStatus
from drivetwin.files.bus_file import BusFile, BusPredictionRecord, build_bus_file
from drivetwin.findings import Code, Finding, explain
from drivetwin.report.blocks import (
    Block,
    FigureBlock,
    Page,
    Section,
    TableBlock,
    Tile,
    TilesBlock,
    Tone,
    VerdictBlock,
    build_findings_section,
    make_notes,
    make_table,
    make_tables,
)
from drivetwin.report.figure import (
    BAND,
    MEASURED,
    OVER,
    SIMULATED,
    UNDER,
    Figure,
    get_parameter_label,
)
from drivetwin.report.model_verdict import ModelVerdict, build_verdict_block
from drivetwin.report.parameters import build_parameter_blocks
from drivetwin.report.stack import Curve, Panel, plot_over_time_axis
from drivetwin.tcu.log import SPEEDS
from drivetwin.tcu.outcome import TcuIdentification
from drivetwin.tcu.predict import PredictedShift
from drivetwin.vehicle.card import RatioCard

_HEIGHT = 130
"""Height of a panel [px]."""
_SHOWN = 8
"""Decays of a gear in a figure [count]."""


@dataclass(frozen=True, eq=False)
class BusOutcome:
    """Result of the bus logs of one vehicle with the names of the logs and the reader's remarks."""

    logs: tuple[str, ...]
    found: BusIdentification
    remarks: tuple[Finding, ...]

    @property
    def verdict(self) -> VerdictBlock:
        """Verdict on the quantities."""
        found = self.found
        return explain_bus(found.estimates, found.findings, found.predictions.values())

    def build_file(self, settings: Mapping[str, str] | None = None) -> BusFile:
        """Build the result file with the settings of the run."""
        return build_bus_file(self.found, self.logs, self.remarks, settings)

    def build_blocks(self) -> list[Block]:
        """Build verdict, quantities, shifts with phases, decays, predictions, and findings."""
        found = self.found
        return [
            self.verdict,
            *_build_parameters(found),
            build_phase_table(found.timelines),
            *_build_loads(found),
            *_build_decay_tables(found),
            *_build_prediction_table(found),
            *build_findings_section((*self.remarks, *found.findings)).blocks,
        ]

    def build_sections(self) -> list[Section]:
        """Build the sections of report and workbench."""
        found = self.found
        sections = [
            Section(
                "result",
                "Result",
                "",
                [self.verdict, _build_tiles(found), *_build_parameters(found)],
            ),
            build_findings_section((*self.remarks, *found.findings)),
            Section(
                "shifts",
                "Shifts",
                "Phases from the ratio of the speeds and, where recorded, the slip of the clutch.",
                [build_phase_table(found.timelines)],
            ),
            Section(
                "road-load",
                "Road load",
                "Load at the gearbox output over the efficiency while a gear is held: torque "
                "message less inertia times acceleration.",
                _build_loads(found),
            ),
            Section(
                "decays",
                "Decays after lock-up",
                "Input speed of each decay, and oscillation with common frequency and damping.",
                [*_build_decays(found), *_build_decay_tables(found)],
            ),
            Section(
                "predictions",
                "Held-out decays",
                "The first period gives amplitude, phase and trend; later samples are predicted.",
                [*_build_predictions(found), *_build_prediction_table(found)],
            ),
        ]
        return [one for one in sections if one.blocks]

    def build_page(self) -> Page:
        """Build the report."""
        title = f"Bus logs: {', '.join(self.logs)}"
        subtitle = f"{len(self.logs)} logs · {len(self.found.shifts)} shifts"
        return Page(title, subtitle, self.build_sections())


def identify_vehicle(
    logs: Sequence[ShiftLog], card: RatioCard | None, held: Collection[int] = ()
) -> BusOutcome:
    """Identify one vehicle from its bus logs.

    Parameters
    ----------
    logs : logs of the vehicle
    card : ratios of the gears; None to take them from the speeds
    held : indices of the logs whose decays are predicted by the others

    Raises
    ------
    InputError
        If no log is left to identify.
    NoShiftError
        If no gear is held for long enough.
    """
    fitted = [log for k, log in enumerate(logs) if k not in held]
    if not fitted:
        raise InputError("all logs are held out", "leave at least one to identify")
    found = identify_bus(fitted, card, [log for k, log in enumerate(logs) if k in held])
    remarks = tuple(dict.fromkeys(one for log in logs for one in log.findings))
    return BusOutcome(tuple(Path(log.source).name for log in logs), found, remarks)


def explain_bus(
    estimates: Mapping[str, Estimate],
    findings: Sequence[Finding],
    predictions: Iterable[DecayPrediction | BusPredictionRecord],
) -> VerdictBlock:
    """Build the verdict on a result.

    It is good if some quantities are identified, no shift contradicts the others and the card has
    all ratios. A prediction that is no better than the trend alone is no test.
    """
    verdicts = [one.verdict for one in estimates.values()]
    count = verdicts.count(Verdict.IDENTIFIED)
    status = f"{count} of {len(verdicts)} quantities identified"
    wrong_card = next((one for one in findings if one.code is Code.RATIO_UNKNOWN), None)
    contradictions = [one for one in findings if one.code is Code.BUS_SHIFTS_CONTRADICT]
    if wrong_card is not None:
        reason, action, tone = wrong_card.cause, wrong_card.remedy, Tone.DOUBTFUL
    elif contradictions:
        worst = min(contradictions, key=lambda one: one.numbers["p"].value)
        reason = f"Contradictions between shifts: {len(contradictions)}. {worst.cause}"
        action, tone = worst.remedy, Tone.DOUBTFUL
    else:
        reason, action, tone = _explain_agreement(estimates, count)
    better = [one.error < one.trend_alone for one in predictions]
    if better:
        reason += (
            f" {sum(better)} of {len(better)} predicted held-out decays have a smaller error than "
            "the trend alone."
        )
    return VerdictBlock(status, reason, action, tone, "Bus logs")


def _explain_agreement(estimates: Mapping[str, Estimate], count: int) -> tuple[str, str, Tone]:
    """Return reason, next step and colour of a result without contradictions."""
    open_ids = [
        name
        for name, one in estimates.items()
        if one.verdict in (Verdict.WEAK, Verdict.NOT_IDENTIFIABLE)
        and one.reason != explain(Code.BUS_NO_METER)
    ]
    wanted = next((estimates[name].reason for name in open_ids if estimates[name].reason), "")
    if not count:
        return "No quantity is determined by these logs.", wanted, Tone.BAD
    reason = "The shifts agree with each other within the intervals."
    action = "Use the identified values; speeds and engine torque give no clutch model to simulate."
    if wanted:
        action += f" First of the others, {get_parameter_label(open_ids[0])}: {wanted}"
    return reason, action, Tone.GOOD


def _build_tiles(found: BusIdentification) -> TilesBlock:
    identified = [one for one in found.estimates.values() if one.verdict is Verdict.IDENTIFIED]
    decays = sum(len(one.fits) for one in found.decays.values())
    tiles = [
        Tile("shifts", str(len(found.shifts))),
        Tile("decays", str(decays), note=f"in {len(found.decays)} gears"),
        Tile("identified", str(len(identified)), note=f"of {len(found.estimates)} quantities"),
    ]
    return TilesBlock(tiles)


def _build_parameters(found: BusIdentification) -> list[Block]:
    caption = "Quantities of all shifts together. Intervals contain the scatter between shifts."
    return build_parameter_blocks(found.estimates, caption)


def build_phase_table(timelines: Sequence[Timeline]) -> TableBlock:
    """Phases of all shifts, with begin and length."""
    rows = []
    for line in timelines:
        for shift in line.shifts:
            name = f"{line.log.label}, {shift.label}"
            start = shift.phases[0][1][0]
            for phase, (low, high) in shift.phases:
                rows.append((name, phase.value, low, low - start, high - low))
                name = ""
    columns = ("shift", "phase", ("at s", ".2f"), ("from begin s", ".2f"), ("length s", ".2f"))
    return make_table("Shifts and their phases", columns, rows)


def _build_loads(found: BusIdentification) -> list[Block]:
    """Build the table of the road load by span, in the order of speed."""
    rows = []
    for one in sorted(found.loads, key=lambda one: one.speed):
        value, half = format_uncertainty(one.torque, Z95 * one.std)
        rows.append((one.label, one.speed * RPM.factor, value, half))
    columns = ("span", ("n_out rpm", ".0f"), ("load over η N·m", "s"), ("± 95 %", "s"))
    return make_tables("Road load over output speed", columns, rows)


def _build_decay_tables(found: BusIdentification) -> Iterator[Block]:
    for gear, joint in found.decays.items():
        combined = joint.combined
        caption = (
            f"Gear {gear}: agreement of each decay with the others by noise alone; "
            f"all together p = {combined.p_value:.2g}"
        )
        yield from make_tables(caption, ("decay", ("p", ".2g")), combined.p_values.items())


def _build_decays(found: BusIdentification) -> Iterator[Block]:
    for gear, joint in found.decays.items():
        window = f"from {RING_DOWN.latest_start:g} s after lock-up for at most {DECAY.length:g} s"
        caption = f"Decays in gear {gear}, the first {_SHOWN}; fitted {window}."
        yield FigureBlock(_plot_decays(joint), caption)


def _plot_decays(joint: JointDecay) -> Figure:
    panels = [
        Panel(
            "n_in",
            RPM,
            [
                Curve("fitted", fit.record.time, fit.fitted, SIMULATED, UNDER),
                Curve(fit.record.label, fit.record.time, fit.record.values, MEASURED, OVER),
            ],
        )
        for fit in joint.fits[:_SHOWN]
    ]
    end = max(float(fit.record.time[-1]) for fit in joint.fits[:_SHOWN])
    return plot_over_time_axis(panels, (0.0, end), _HEIGHT * len(panels) + 60)


def _build_predictions(found: BusIdentification) -> Iterator[Block]:
    shown = list(found.predictions.values())[:_SHOWN]
    if not shown:
        return
    end = max(float(one.record.time[-1]) for one in shown)
    panels = [_build_prediction_panel(one) for one in shown]
    figure = plot_over_time_axis(panels, (0.0, end), _HEIGHT * len(panels) + 60)
    yield FigureBlock(figure, "Decays that took no part, with the 95 % band of the prediction.")


def _build_prediction_panel(one: DecayPrediction) -> Panel:
    time, k = one.record.time, one.predicted
    half = Z95 * one.std[k]
    curves = [
        Curve("95 % band", time[k], one.mean[k] - half, BAND, width=0.5, listed=False),
        Curve("95 % band", time[k], one.mean[k] + half, BAND, width=0.5, fill=BAND),
        Curve(one.record.label, time, one.record.values, MEASURED),
        Curve("predicted", time[k], one.mean[k], SIMULATED),
    ]
    return Panel("n_in", RPM, curves)


def _build_prediction_table(found: BusIdentification) -> list[Block]:
    rows = [
        (
            name,
            one.predicted.size,
            100.0 * one.share_inside,
            *(each * RPM.factor for each in (one.error, one.oscillation, one.trend_alone)),
        )
        for name, one in found.predictions.items()
    ]
    sizes = (("error rpm", "3"), ("oscillation rpm", "3"), ("trend alone rpm", "3"))
    columns = ("decay", ("samples", "d"), ("inside band %", ".1f"), *sizes)
    return make_tables("Prediction of held-out decays by the others", columns, rows)


_TCU_HEIGHT = 190
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
    return plot_over_time_axis(panels, (float(time[0]), float(time[-1])), 3 * _TCU_HEIGHT)
