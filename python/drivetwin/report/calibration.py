# SPDX-License-Identifier: MIT
"""A calibration as one HTML page that opens offline, and the correction of its twin by logs."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin._util.display_units import NM, RPM, Display, get_display_unit, spell_unit
from drivetwin._util.request import CELSIUS
from drivetwin.calibration.calibrate import Calibration
from drivetwin.calibration.certificate import TYPES, UNITS, LimitCheck, LimitState
from drivetwin.calibration.learn import Correction, LoggedFit
from drivetwin.calibration.maneuver import ClosedLoop, OperatingPoint
from drivetwin.calibration.metrics import METRICS, Metric
from drivetwin.calibration.objective import describe_unusual
from drivetwin.calibration.operating_map import Front, MapPoint, OperatingMap
from drivetwin.estimation.result.estimate import Z95
from drivetwin.findings import Finding
from drivetwin.report.blocks import (
    Block,
    Cell,
    Column,
    FigureBlock,
    Page,
    Section,
    TableBlock,
    TextBlock,
    Tile,
    TilesBlock,
    Tone,
    build_findings_section,
    make_badge,
    make_notes,
    make_number,
    make_table,
    make_tables,
)
from drivetwin.report.figure import (
    MEASURED,
    MUTED,
    SIMULATED,
    Figure,
    make_axis,
    make_layout,
    make_trace,
)
from drivetwin.report.stack import Curve, Panel, compute_full_range, plot_over_time_axis
from drivetwin.report.trial import get_metric_display, plot_distributions, plot_profiles

_FEWEST_MOVED = 0.01
"""Narrowing of an interval below which the logs say nothing of a value [ratio]."""


def build_correction_blocks(found: Correction, next_one: Calibration) -> list[Block]:
    """Gain to expect, fit of the logged shifts, and the learned values with their intervals.

    `next_one` is the calibration on the corrected twin, whose start is an earlier one.
    """
    tables = [_build_fit(found), _build_learned(found)]
    return [_build_gain(next_one), *tables, *(_plot_fit(one) for one in found.fits)]


def _plot_fit(fit: LoggedFit) -> FigureBlock:
    """Plot the measured signals of a shift over those predicted before and after the correction."""
    panels = []
    for role, one in fit.after.traces.items():
        drawn = (
            ("measured", one.measured, MEASURED, 1.0),
            ("predicted before", fit.before.traces[role].simulated, MUTED, 1.5),
            ("predicted after", one.simulated, SIMULATED, 1.5),
        )
        curves = [Curve(name, one.time, y, colour, width=width) for name, y, colour, width in drawn]
        display = NM if role == "output_torque" else RPM
        panels.append(Panel(role.replace("_", " "), display, curves))
    figure = plot_over_time_axis(panels, compute_full_range(panels), 640)
    return FigureBlock(
        figure, f"{fit.source}: measured, and predicted before and after the correction."
    )


def _build_gain(found: Calibration) -> TilesBlock:
    old, new = (
        one.certificate.quantiles[Metric.PEAK_JERK].share_95 for one in (found.before, found.after)
    )
    gain = 100.0 * (1.0 - new / old)
    tone = Tone.GOOD if gain > 0.0 else Tone.DOUBTFUL
    note = f"95 % peak jerk {new:.1f} after {old:.1f} m/s³, by the corrected twin"
    return TilesBlock([Tile("gain to expect", f"{gain:.0f} %", tone, note)])


def _build_fit(found: Correction) -> TableBlock:
    rows = []
    for name, (before, after) in found.rms.items():
        unit = "N·m" if name.endswith("torque") else "rad/s"
        rows.append((name, unit, before, after))
    return make_table(
        "Logged shifts: RMS deviation of the simulation",
        ("signal", "unit", ("before", ".3g"), ("after", ".3g")),
        rows,
    )


def _build_learned(found: Correction) -> TableBlock:
    rows = [
        (
            *(one.id, spell_unit(one.unit), one.before, Z95 * one.before_std),
            *(one.after, Z95 * one.after_std, f"{one.moved:+.1f}"),
        )
        for one in found.values
        if one.after_std < (1.0 - _FEWEST_MOVED) * one.before_std
    ]
    numbers = (("before", ".5g"), ("± 95 %", ".2g"), ("after", ".5g"), ("± 95 %", ".2g"))
    return make_table(
        "Learned values of this vehicle, SI; the move is in standard deviations before",
        ("parameter", "unit", *numbers, ("move", "s")),
        rows,
    )


_TONES = {
    LimitState.CERTIFIED: Tone.GOOD,
    LimitState.KEPT: Tone.DOUBTFUL,
    LimitState.EXCEEDED: Tone.UNKNOWN,
}


def build_calibration_page(
    found: Calibration,
    title: str,
    shown: tuple[Sequence[Finding], Sequence[Block]],
    front: Front | None = None,
    mapped: OperatingMap | None = None,
) -> Page:
    """Build the page: with front and map; equal calibrations give equal text.

    `shown` are the findings, and the blocks of a correction by logs, empty without one.
    """
    findings, learned = shown
    draws = found.after.certificate.draws
    point = found.task.maneuver.point
    subtitle = (
        f"engine torque {point.engine_torque:.0f} Nm, engine speed "
        f"{point.engine_speed * RPM.factor:.0f} rpm at the request · {draws} fresh draws"
    )
    if (celsius := _to_celsius(point)) is not None:
        subtitle += f" · oil at {celsius:.0f} °C"
    around = [build_front_section(front), build_map_section(mapped)]
    sections = _build_sections(found, findings)
    if learned:
        around.insert(0, Section("logs", "Learned from logs", "", learned))
    sections[1:1] = [one for one in around if one.blocks]
    return Page(title, subtitle, sections)


def _build_sections(found: Calibration, findings: Sequence[Finding]) -> list[Section]:
    unit = " of the nominal unit" if isinstance(found.after.control, ClosedLoop) else ""
    profiles = FigureBlock(
        plot_profiles(found),
        f"Pressures at the clutches and engine torque{unit} before (dotted, grey) and "
        "after; acceleration change of the vehicle and slip with 95 % bands over the units. Time "
        "from the request.",
    )
    outside = make_notes(
        "Outside the identified range", [one.text for one in findings], Tone.DOUBTFUL
    )
    return [
        Section(
            "result",
            "Result",
            "Statistics over fresh draws that were not optimised over.",
            [_build_tiles(found), *_build_headline(found), _build_limits(found), *outside],
        ),
        Section("profiles", "Profiles", "Before and after, over the spread band.", [profiles]),
        Section(
            "certificate",
            "Certificate",
            _describe_confidence(found),
            [_build_statistics(found), _build_events(found), _build_shares(found)],
        ),
        Section(
            "distributions",
            "Distributions",
            "Each metric over the fresh draws; lines are limits (dashed: of the mean).",
            [FigureBlock(plot_distributions(found), "Share of the draws.")],
        ),
        Section(
            "parameters",
            "Parameters",
            "Policy before and after.",
            [*_build_bounds(found), _build_values(found)],
        ),
        Section("definitions", "Metrics", "Definition and source.", [_build_definitions()]),
    ]


def _build_tiles(found: Calibration) -> TilesBlock:
    before, after = found.before.certificate, found.after.certificate
    old = before.quantiles[Metric.PEAK_JERK].share_95
    new = after.quantiles[Metric.PEAK_JERK].share_95
    promised = after.quantiles[Metric.PEAK_JERK].promised
    tiles = [
        Tile("promised peak jerk", "–" if promised is None else f"{promised:.1f} m/s³",
             note="for 95 % of the units"),
        Tile("95 % peak jerk", f"{new:.1f} m/s³", Tone.GOOD if new < old else Tone.DOUBTFUL,
             f"before {old:.1f} m/s³"),
        Tile("worst of the draws", f"{after.quantiles[Metric.PEAK_JERK].worst:.1f} m/s³",
             note=f"before {before.quantiles[Metric.PEAK_JERK].worst:.1f} m/s³"),
        Tile("limits that bind", str(sum(one.binding for one in after.limits)),
             note=f"of {len(after.limits)}"),
        Tile("draws without lock-up", str(after.unlocked),
             Tone.GOOD if after.unlocked == 0 else Tone.DOUBTFUL, f"of {after.draws}"),
    ]  # fmt: skip
    return TilesBlock(tiles)


def build_calibration_blocks(
    found: Calibration,
    findings: Sequence[Finding],
    front: Front | None = None,
    mapped: OperatingMap | None = None,
) -> list[Block]:
    """Limits, statistics and events of a calibration, front and map, and findings."""
    around = [build_front_section(front), build_map_section(mapped)]
    tables = [one for section in around for one in section.blocks]
    return [
        *_build_headline(found),
        *(_build_limits(found), _build_statistics(found), _build_events(found)),
        *(_build_shares(found), *_build_bounds(found)),
        *tables,
        *build_findings_section(findings).blocks,
    ]


def _build_headline(found: Calibration) -> list[Block]:
    """Build the result in a sentence, what got worse, and what usual hardware cannot do."""
    before, after = (one.certificate.quantiles for one in (found.before, found.after))
    old, new = before[Metric.PEAK_JERK].share_95, after[Metric.PEAK_JERK].share_95
    limits = found.after.certificate.limits
    kept = sum(one.state is not LimitState.EXCEEDED for one in limits)
    worse = [
        f"{METRICS[name].label} {old:.4g} → {new:.4g} {display.label}"
        for name in METRICS
        for display in [get_metric_display(name)]
        for old, new in [
            (before[name].share_95 * display.factor, after[name].share_95 * display.factor)
        ]
        if after[name].share_95 > (before[name].upper_95 or before[name].worst)
    ]
    usual = {name: one.share_95 for name, one in after.items()}
    unusual = describe_unusual(usual, found.task.maneuver.point.engine_torque)
    return [
        *make_notes("Worse than the start, for 95 % of the units", worse, Tone.DOUBTFUL),
        *([TextBlock(unusual)] if unusual else []),
        TextBlock(
            f"Peak jerk of 95 % of the units {old:.1f} → {new:.1f} m/s³ "
            f"({100.0 * (new / old - 1.0):+.0f} %); {kept} of {len(limits)} limits are kept."
            + _describe_gap(found.bound, new)
        ),
    ]


def _describe_gap(bound: float | None, jerk: float) -> str:
    """Describe the distance from the bound from below, if there is one."""
    if bound is None:
        return ""
    return (
        f" No profile comes below {bound:.2g} m/s³ on the nominal driveline: a gap of "
        f"{jerk - bound:.3g} m/s³ for the spread of the units and the policy."
    )


def _build_limits(found: Calibration) -> TableBlock:
    rows = [_build_limit_row(one) for one in found.after.certificate.limits]
    return make_table(
        "Limits; the upper bound holds with the stated confidence",
        ("metric", "for", ("limit", "s"), ("value", ".4g"), ("upper", ".4g"), "state", "source"),
        rows,
    )


def _build_limit_row(one: LimitCheck) -> tuple[object, ...]:
    display = get_metric_display(one.limit.metric)
    return (
        *(METRICS[one.limit.metric].label, one.limit.statistic.value),
        f"{one.limit.bound * display.factor:.4g} {display.label}",
        one.value * display.factor,
        None if one.upper is None else one.upper * display.factor,
        make_badge(one.text, _TONES[one.state]),
        one.limit.source or "as stated",
    )


def _describe_confidence(found: Calibration) -> str:
    one = found.after.certificate
    return (
        f"Upper bounds by order statistics of {one.draws} draws hold with "
        f"{100.0 * one.confidence:.0f} % confidence. With the same confidence, "
        f"{100.0 * one.worst_share:.2f} % of all units stay below the worst value drawn. "
        "Only the stated spread and the identified covariance are drawn: wear is not. "
        "The promised value is kept by "
        f"95 % of the units of {100.0 * found.task.settings.promise_confidence:.0f} % of the "
        "vehicle types that the log leaves possible."
    )


def _build_statistics(found: Calibration) -> TableBlock:
    rows = []
    for metric, spec in METRICS.items():
        display = get_metric_display(metric)
        for part, one in (("before", found.before), ("after", found.after)):
            q = one.certificate.quantiles[metric]
            values = (
                *(q.median, q.mean, q.share_95, q.upper_95),
                *(q.share_99, q.upper_99, q.worst, q.promised),
            )
            # A flare of 1e-11 rpm is round-off.
            scaled = (None if v is None else f"{round(v * display.factor, 9):.4g}" for v in values)
            label = f"{spec.label} [{display.label}]" if part == "before" else ""
            rows.append((label, part, *scaled))
    columns: Sequence[Column] = (
        *("metric", ""),
        *(make_number(name, secondary=True) for name in ("median", "mean")),
        *(("95 %", "s"), ("upper", "s"), ("99 %", "s")),
        make_number("upper", secondary=True),
        *(("worst", "s"), ("promised", "s")),
    )
    return make_table("Metrics over the fresh draws", columns, rows)


def _build_events(found: Calibration) -> TableBlock:
    rows = []
    for part, one in (("before", found.before.certificate), ("after", found.after.certificate)):
        for label, count, bound in (
            ("no lock-up", one.unlocked, one.unlocked_upper),
            ("slips again after lock-up", one.relocked, one.relocked_upper),
        ):
            rows.append((label, part, count, f"{100.0 * bound:.2f} %"))
    columns = ("event", "", ("draws", "d"), ("upper bound of share", "s"))
    return make_table("Events of the on-coming element", columns, rows)


def _build_shares(found: Calibration) -> TableBlock:
    """Shares of the variance of peak jerk, largest first within stages and within elements."""
    shares = found.after.certificate.shares
    stages = {name: one for name, one in shares.items() if name in (TYPES, UNITS)}
    parts = {name: one for name, one in shares.items() if name not in stages}
    rows = [
        (name, 100.0 * one)
        for group in (stages, parts)
        for name, one in sorted(group.items(), key=lambda item: -item[1])
    ]
    return make_table(
        "Variance of peak jerk by its source: uncertainty of identified values and production "
        "scatter; then what only one element explains, and what several do together",
        ("uncertainty", ("share [%]", ".0f")),
        rows,
    )


def _build_values(found: Calibration) -> TableBlock:
    before, after = found.before.values.tolist(), found.after.values.tolist()
    rows = []
    for one, old, new in zip(found.task.policy.parameters, before, after, strict=True):
        text = one.text if one.free else f"{one.text} (kept)"
        display = get_parameter_display(one.unit)
        numbers = (number * display.factor for number in (old, new, one.low, one.high))
        rows.append((one.name, display.label, *numbers, text))
    heads = ((name, ".5g") for name in ("before", "after", "low", "high"))
    columns: Sequence[Column] = ("parameter", "unit", *heads, "meaning")
    return make_table("Parameters of the policy", columns, rows)


def get_parameter_display(unit: str) -> Display:
    """Return the display unit of a parameter: pressures are shown in bar, others in their unit."""
    return get_display_unit(unit) if unit in ("Pa", "Pa/s") else Display(spell_unit(unit))


def _build_bounds(found: Calibration) -> list[Block]:
    rows = [
        (one.name, at.label, end * at.factor, "lower" if end == one.low else "upper", one.text)
        for one, end in found.task.policy.list_at_bounds(found.after.values)
        for at in [get_parameter_display(one.unit)]
    ]
    columns: Sequence[Column] = ("parameter", "unit", ("bound", ".5g"), "side", "meaning")
    return make_tables(f"Bounds that bind: {len(rows)}", columns, rows)


def _build_definitions() -> TableBlock:
    rows = [
        (one.label, spell_unit(one.unit), one.definition, one.source) for one in METRICS.values()
    ]
    return make_table("Metrics", ("metric", "unit", "definition", "source"), rows)


def build_front_section(front: Front | None) -> Section:
    """Figure and table of the front; without a front no blocks."""
    blocks: list[Block] = []
    if front is not None:
        caption = "Points that no other one dominates; the label is the mean friction energy in kJ."
        blocks = [FigureBlock(plot_front(front), caption), _build_front_table(front)]
    return Section(
        "front",
        "Comfort, energy and time",
        "Calibrations with other limits of shift time and friction energy, each polished from its "
        "neighbour: other solutions far from this one are not searched. Fresh draws.",
        blocks,
    )


def plot_front(front: Front) -> Figure:
    """Peak jerk over shift time, both for 95 % of the units, labelled with the energy in kJ."""
    figure = Figure(
        make_trace(
            "scatter",
            x=[one.time for one in front.points],
            y=[one.jerk for one in front.points],
            text=[f"{1e-3 * one.energy:.0f}" for one in front.points],
            mode="markers+text",
            textposition="top center",
            marker={"color": SIMULATED, "size": 9},
            showlegend=False,
        )
    )
    axes = {"xaxis": make_axis("shift time [s]"), "yaxis": make_axis("peak jerk [m/s³]")}
    figure.set_layout(make_layout(380, **axes))
    return figure


def _build_front_table(front: Front) -> TableBlock:
    rows = [(one.arm.value, one.time, one.jerk, 1e-3 * one.energy) for one in front.points]
    columns = (
        *("moved limit", ("shift time, 95 % [s]", ".3f"), ("peak jerk, 95 % [m/s³]", ".1f")),
        ("mean friction energy [kJ]", ".1f"),
    )
    return make_table(f"{len(front.points)} of {front.tried} calibrations", columns, rows)


def build_map_section(mapped: OperatingMap | None) -> Section:
    """Tables of the grid points and of the centres between them; without a map no blocks."""
    blocks: list[Block] = []
    if mapped is not None:
        points = [mapped.points[place] for place in sorted(mapped.points)]
        blocks = [
            _build_map_table("Grid points", points),
            _build_map_table("Centres of the cells, by interpolation", mapped.between),
        ]
    return Section(
        "map",
        "Map over the operating points",
        "Each point is polished from its neighbour. Values between the points are linear in torque "
        "and speed. Fresh draws.",
        blocks,
    )


def _build_map_table(caption: str, points: Sequence[MapPoint]) -> TableBlock:
    columns = (
        *(("engine torque [Nm]", ".0f"), ("engine speed [rpm]", ".0f"), ("oil [°C]", ".0f")),
        *(("peak jerk, 95 % [m/s³]", ".1f"), ("shift time, 95 % [s]", ".3f")),
        *(("mean friction energy [kJ]", ".1f"), "limits"),
    )
    return make_table(caption, columns, [_build_map_row(one) for one in points])


def _to_celsius(point: OperatingPoint) -> float | None:
    kelvin = point.oil_temperature
    return None if kelvin is None else kelvin - CELSIUS.offset


def _build_map_row(one: MapPoint) -> tuple[object, ...]:
    point, certificate = one.task.maneuver.point, one.found.certificate
    exceeded = [each for each in certificate.limits if each.state is LimitState.EXCEEDED]
    named = ", ".join(METRICS[each.limit.metric].label for each in exceeded)
    return (
        *(point.engine_torque, point.engine_speed * RPM.factor, _to_celsius(point), one.jerk),
        certificate.quantiles[Metric.SHIFT_TIME].share_95,
        1e-3 * certificate.quantiles[Metric.FRICTION_ENERGY].mean,
        Cell(f"exceeds {named}", tone=Tone.DOUBTFUL) if exceeded else "kept",
    )
