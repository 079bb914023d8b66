# SPDX-License-Identifier: MIT
"""Result of a controller on the test bench: page, blocks for the terminal, JUnit XML."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import BAR, NM, Display
from drivetwin._util.visible_text import escape_line
from drivetwin.calibration.metrics import METRICS, Metric
from drivetwin.calibration.trial import Check, Scale, Trial
from drivetwin.calibration.trial_comparison import Difference
from drivetwin.report.blocks import (
    Block,
    FigureBlock,
    Section,
    TableBlock,
    Tone,
    make_badge,
    make_notes,
    make_table,
)
from drivetwin.report.figure import Figure
from drivetwin.report.figures.calibration import get_metric_display
from drivetwin.report.figures.stack import Curve, Panel, compute_full_range, plot_over_time_axis
from drivetwin.report.html import render_page
from drivetwin.report.style import ACCENT, MEASURED

_SHOWN = 12
"""Largest number of runs on the page: each has some 100 kB."""


def build_trial_blocks(found: Sequence[Trial], differences: Sequence[Difference]) -> list[Block]:
    """Build the verdict of each scenario, the failed assertions and the comparison."""
    failures = [
        f"{one.scenario.name}: {fault}"
        for one in found
        for fault in (one.error, *(_describe(check, one) for check in one.checks))
        if fault
    ]
    tables = [_build_comparison(differences)] if differences else []
    return [
        _build_scenarios(found),
        *make_notes("Failed assertions", failures, Tone.BAD),
        *tables,
    ]


def render_trials(found: Sequence[Trial], differences: Sequence[Difference], title: str) -> str:
    """Return the HTML text of the page; failed scenarios come first among the worst runs."""
    runs = [
        FigureBlock(_plot_run(one.worst), f"{one.scenario.name}: run {one.place}")
        for one in sorted(found, key=lambda one: not one.failed)
        if one.worst
    ]
    intro = (
        "The run of each scenario that exceeds its bounds most or is nearest to them. Time from "
        "the request; dotted lines are commands."
    )
    sections = [
        Section("result", "Result", "", build_trial_blocks(found, differences)),
        Section("runs", "Worst runs", intro, runs[:_SHOWN]),
    ]
    return render_page(title, "", sections)


def format_junit(found: Sequence[Trial], name: str) -> str:
    """Return JUnit XML: a suite for each scenario, a case for each assertion."""
    root = ET.Element("testsuites", name=name)
    for one in found:
        cases = {check.key: _describe(check, one) for check in one.checks} or {"runs": one.error}
        counts = {"tests": len(cases), "failures": sum(check.failed > 0 for check in one.checks)}
        texts = {key: str(count) for key, count in counts.items()}
        suite = ET.SubElement(root, "testsuite", {"name": one.scenario.name, **texts})
        for key, fault in cases.items():
            case = ET.SubElement(suite, "testcase", classname=name, name=key)
            if fault:
                kind = "error" if one.error else "failure"
                ET.SubElement(case, kind, message=escape_line(fault))
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n"


def _describe(check: Check, trial: Trial) -> str:
    """Describe a failed assertion; an empty text where it holds."""
    if not check.failed:
        return ""
    counted = check.quantity not in METRICS or check.scale is Scale.CHANGE
    display = Display("") if counted else get_metric_display(Metric(check.quantity))
    return (
        f"{check.key} is {check.worst * display.factor:.4g} in run {check.place}, above "
        f"{check.bound * display.factor:.4g} {display.label}".rstrip()
        + f" ({check.failed} of {trial.scenario.draws} runs)"
    )


def _build_scenarios(found: Sequence[Trial]) -> TableBlock:
    rows = []
    for one in found:
        state = make_badge("failed", Tone.BAD) if one.failed else make_badge("passed", Tone.GOOD)
        numbers: tuple[float | None, ...] = (None,) * 4
        if one.certificate is not None:
            jerk, time = (
                one.certificate.quantiles[each] for each in (Metric.PEAK_JERK, Metric.SHIFT_TIME)
            )
            unlocked = float(one.certificate.unlocked)
            numbers = (jerk.median, jerk.worst, time.worst, unlocked)
        rows.append((one.scenario.name, state, one.scenario.draws, *numbers))
    columns = (
        *("scenario", "state", ("runs", "d"), ("peak jerk, median [m/s³]", ".1f")),
        *(("worst", ".1f"), ("longest shift [s]", ".2f"), ("not locked", ".0f")),
    )
    return make_table(f"{sum(one.failed for one in found)} of {len(found)} scenarios failed",
                      columns, rows)  # fmt: skip


def _build_comparison(found: Sequence[Difference]) -> TableBlock:
    rows = []
    for one in found:
        if one.differs:
            display = get_metric_display(one.metric)
            numbers = (one.first, one.second, one.low, one.high)
            share = 100.0 * (one.second / one.first - 1.0) if one.first else None
            scaled = (f"{number * display.factor:.4g}" for number in numbers)
            label = f"{METRICS[one.metric].label} [{display.label}]"
            rows.append((one.scenario, label, one.pairs, *scaled, share, f"{one.p:.2g}"))
    columns = (
        *("scenario", "metric", ("pairs", "d"), ("A", "s"), ("B", "s")),
        *(("B - A from", "s"), ("to", "s"), ("B - A [%]", "+.1f"), ("p", "s")),
    )
    caption = f"Differences of B to A: {len(rows)} of {len(found)} metrics (Wilcoxon and Holm, 5 %)"
    return make_table(caption, columns, rows)


def _plot_run(of: Mapping[str, FloatArray]) -> Figure:
    def draw(*names: str, dash: str = "solid") -> list[Curve]:
        return [
            Curve(name, of["time"], of[name], colour, dash=dash)
            for name, colour in zip(names, (MEASURED, ACCENT), strict=False)
        ]

    commands = draw("command.offgoing", "command.oncoming", dash="dot")
    slips = [name for name in of if name.startswith("slip")]
    demand = draw("command.engine_torque", dash="dot")
    panels = [
        Panel("pressure", BAR, [*draw("pressure.offgoing", "pressure.oncoming"), *commands]),
        Panel("engine torque", NM, [*draw("engine_torque"), *demand]),
        Panel("slip", Display("rad/s"), draw(*slips)),
        Panel("output torque", NM, draw("shaft_torque of output shaft")),
    ]
    return plot_over_time_axis(panels, compute_full_range(panels), 720)
