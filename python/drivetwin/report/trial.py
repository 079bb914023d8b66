# SPDX-License-Identifier: MIT
"""Result of a controller on the test bench: page, blocks for the terminal, JUnit XML."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import BAR, NM, Display, get_display_unit
from drivetwin._util.text import escape_line
from drivetwin.calibration.calibrate import Assessment, Calibration
from drivetwin.calibration.evaluate import Plant, get_vehicle_inertias
from drivetwin.calibration.metrics import METRICS, Metric, compute_acceleration
from drivetwin.calibration.objective import Statistic
from drivetwin.calibration.trial import Check, Difference, Scale, Trial
from drivetwin.report.blocks import (
    Block,
    FigureBlock,
    Page,
    Section,
    TableBlock,
    Tone,
    make_badge,
    make_notes,
    make_table,
)
from drivetwin.report.figure import (
    ACCENT,
    MEASURED,
    MUTED,
    SIMULATED,
    Entry,
    Figure,
    make_axis,
    make_layout,
    make_subplots,
    make_trace,
)
from drivetwin.report.stack import Curve, Panel, compute_full_range, plot_over_time_axis
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import Output

_DRAWN = 200
"""Runs behind a band."""
_BAND = (2.5, 97.5)
"""Percentiles of a band, 95 % of the units."""
_COLOURS = {"before": MUTED, "after": SIMULATED}
_FILLS = {"before": "rgba(138,143,152,0.20)", "after": "rgba(213,94,0,0.20)"}
_ACCELERATION = Display("m/s²")
_SPEED = Display("rad/s")
_COLUMNS = 2
_SECONDS = Display("s")


def plot_profiles(found: Calibration) -> Figure:
    """Profiles before and after, with acceleration and slip over the spread band.

    Time counts from the request.
    """
    shift = found.task.maneuver
    time = shift.time - shift.request
    parts = {"before": found.before, "after": found.after}
    bands = {name: _simulate_bands(found, one) for name, one in parts.items()}
    pressures = [
        Curve(
            f"{label} {name}",
            time,
            _sample(getattr(one.profiles, key), shift.time),
            MEASURED if key == "offgoing" else ACCENT,
            dash="dot" if name == "before" else "solid",
        )
        for name, one in parts.items()
        for key, label in (("offgoing", shift.offgoing.name), ("oncoming", shift.oncoming.name))
    ]
    torques = [
        Curve(name, time, _sample(one.profiles.engine_torque, shift.time), _COLOURS[name])
        for name, one in parts.items()
    ]
    panels = [
        Panel("pressure", BAR, pressures, weight=1.3),
        Panel("engine torque", NM, torques, weight=0.8),
        Panel("acceleration", _ACCELERATION, _draw_bands(time, bands, 0), weight=1.3),
        Panel(f"slip of {shift.oncoming.name}", _SPEED, _draw_bands(time, bands, 1)),
    ]
    return plot_over_time_axis(panels, compute_full_range(panels), 820)


def plot_distributions(found: Calibration) -> Figure:
    """Histogram of each metric before and after over the fresh draws; limits as lines."""
    names = list(Metric)
    rows = -(-len(names) // _COLUMNS)
    titles = [f"{METRICS[one].label} [{get_metric_display(one).label}]" for one in names]
    figure = make_subplots(_COLUMNS * [1.0], rows * [1.0], gaps=(0.1, 0.5 / rows), titles=titles)
    for k, metric in enumerate(names):
        place = {"row": k // _COLUMNS + 1, "col": k % _COLUMNS + 1}
        for part, one in (("before", found.before), ("after", found.after)):
            values = get_metric_display(metric).to_display(one.outcome.values[metric])
            figure.add_trace(_build_histogram(part, values, listed=k == 0), **place)
        for limit in found.task.limits:
            if limit.metric is metric:
                at = limit.bound * get_metric_display(metric).factor
                dash = "dash" if limit.statistic is Statistic.MEAN else "solid"
                figure.add_vline(x=at, line={"color": MEASURED, "dash": dash}, **place)
    figure.merge_layout(**make_layout(210 * rows, barmode="overlay"))
    figure.merge_layout(margin={"t": 70}, legend={"y": 1.04})
    figure.update_axes("y", make_axis("", showticklabels=False))
    return figure


def get_metric_display(metric: Metric) -> Display:
    """Return the display unit of a metric; times are shown in seconds."""
    unit = METRICS[metric].unit
    return _SECONDS if unit == "s" else get_display_unit(unit)


def _build_histogram(name: str, values: FloatArray, *, listed: bool) -> Entry:
    return make_trace(
        "histogram",
        x=values.astype("float32"),
        name=name,
        nbinsx=60,
        histnorm="probability",
        opacity=0.6,
        marker={"color": _COLOURS[name]},
        legendgroup=name,
        showlegend=listed,
    )


def _sample(signal: Signal, time: FloatArray) -> FloatArray:
    return np.interp(time, signal.time, signal.values)


def _simulate_bands(found: Calibration, one: Assessment) -> tuple[FloatArray, FloatArray]:
    """Bands of the vehicle's acceleration change and of the on-coming element's slip."""
    shift = found.task.maneuver
    draws = found.fresh.select(slice(0, _DRAWN))
    outputs: tuple[Output, ...] = (shift.body.drive, ("slip", shift.oncoming.name))
    runs = Plant(shift, found.task.settings.threads, ()).simulate(one.control, draws, outputs)
    columns = runs.columns
    vehicle = get_vehicle_inertias(shift, draws)
    acceleration = compute_acceleration(shift, columns[:, 0], vehicle)
    return _compute_band(acceleration), _compute_band(columns[:, 1])


def _compute_band(values: FloatArray) -> FloatArray:
    """Lower end of the 95 % band of a signal over the units, median, and upper end (3, n)."""
    return np.asarray(np.nanpercentile(values, (_BAND[0], 50.0, _BAND[1]), axis=0))


def _draw_bands(
    time: FloatArray, bands: dict[str, tuple[FloatArray, FloatArray]], which: int
) -> list[Curve]:
    curves = []
    for name, both in bands.items():
        (low, middle, high), colour = both[which], _COLOURS[name]
        curves += [
            Curve(f"{name}, 2.5 %", time, low, colour, width=0.5, listed=False),
            Curve(f"{name}, 97.5 %", time, high, colour, width=0.5, listed=False,
                  fill=_FILLS[name]),
            Curve(name, time, middle, colour),
        ]  # fmt: skip
    return curves


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


def build_trials_page(
    found: Sequence[Trial], differences: Sequence[Difference], title: str
) -> Page:
    """Build the page; failed scenarios come first among the worst runs."""
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
    return Page(title, "", sections)


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
    worst, bound = (
        f"{value * display.factor:.4g} {display.label}".rstrip()
        for value in (check.worst, check.bound)
    )
    return (
        f"{check.key}: {worst} in run {check.place}, above {bound} "
        f"({check.failed} of {trial.scenario.draws} runs)"
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
    counted = f"{len(rows)} of {len(found)} metrics (Wilcoxon and Holm, 5 %)"
    return make_table(f"Differences of B to A: {counted}", columns, rows)


def _plot_run(of: Mapping[str, FloatArray]) -> Figure:
    def draw(*names: str, dash: str = "solid") -> list[Curve]:
        return [
            Curve(name, of["time"], of[name], colour, dash=dash)
            for name, colour in zip(names, (MEASURED, ACCENT), strict=False)
        ]

    commands = draw("command.offgoing", "command.oncoming", dash="dot")
    torques = [*draw("engine_torque"), *draw("command.engine_torque", dash="dot")]
    panels = [
        Panel("pressure", BAR, [*draw("pressure.offgoing", "pressure.oncoming"), *commands]),
        Panel("engine torque", NM, torques),
        Panel("slip", Display("rad/s"), draw(*(name for name in of if name.startswith("slip")))),
        Panel("output torque", NM, draw("shaft_torque of output shaft")),
    ]
    return plot_over_time_axis(panels, compute_full_range(panels), 720)
