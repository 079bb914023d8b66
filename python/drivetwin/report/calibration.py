# SPDX-License-Identifier: MIT
"""A calibration as one HTML page that opens offline."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin._util.display_units import spell_unit
from drivetwin.calibration.calibrate import Calibration
from drivetwin.calibration.certificate import LimitCheck, LimitState
from drivetwin.calibration.front import Front
from drivetwin.calibration.metrics import METRICS, Metric
from drivetwin.calibration.operating_map import OperatingMap
from drivetwin.calibration.profiles import ClosedLoop
from drivetwin.findings import Finding
from drivetwin.report.figures.calibration import (
    build_profile_panels,
    get_metric_display,
    plot_distributions,
    plot_profiles,
)
from drivetwin.report.html import render_page
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
)
from drivetwin.report.sections.calibration_points import build_front_section, build_map_section

_TONES = {
    LimitState.CERTIFIED: Tone.GOOD,
    LimitState.KEPT: Tone.DOUBTFUL,
    LimitState.EXCEEDED: Tone.UNKNOWN,
}


def render_calibration(
    found: Calibration,
    title: str,
    findings: Sequence[Finding],
    front: Front | None = None,
    mapped: OperatingMap | None = None,
) -> str:
    """HTML text of the page, with front and map; equal calibrations give equal text."""
    draws = found.after.certificate.draws
    point = found.task.maneuver.point
    subtitle = (
        f"engine torque {point.engine_torque:.0f} Nm, engine speed "
        f"{point.engine_speed * 9.549297:.0f} rpm at the request · {draws} fresh draws"
    )
    around = [build_front_section(front), build_map_section(mapped)]
    sections = _build_sections(found, findings)
    sections[1:1] = [one for one in around if one.blocks]
    return render_page(title, subtitle, sections)


def _build_sections(found: Calibration, findings: Sequence[Finding]) -> list[Section]:
    profiles = FigureBlock(
        plot_profiles(found),
        f"Pressures at the clutches and engine torque{_name_unit(found)} before (dotted, grey) and "
        "after; acceleration change of the vehicle and slip with 95 % bands over the units. Time "
        "from the request.",
        build_profile_panels(found),
    )
    notes: list[Block] = [
        NotesBlock("Outside the identified range", [one.text for one in findings], Tone.DOUBTFUL)
    ]
    return [
        Section(
            "result",
            "Result",
            "Statistics over fresh draws that were not optimised over.",
            [_build_tiles(found), _build_limits(found), *(notes if findings else [])],
        ),
        Section("profiles", "Profiles", "Before and after, over the spread band.", [profiles]),
        Section(
            "certificate",
            "Certificate",
            _describe_confidence(found),
            [_build_statistics(found), _build_locks(found)],
        ),
        Section(
            "distributions",
            "Distributions",
            "Each metric over the fresh draws; lines are limits (dashed: of the mean).",
            [FigureBlock(plot_distributions(found), "Share of the draws.")],
        ),
        Section("parameters", "Parameters", "Policy before and after.", [_build_values(found)]),
        Section("definitions", "Metrics", "Definition and source.", [_build_definitions()]),
    ]


def _name_unit(found: Calibration) -> str:
    return " of the nominal unit" if isinstance(found.after.control, ClosedLoop) else ""


def _build_tiles(found: Calibration) -> TilesBlock:
    before, after = found.before.certificate, found.after.certificate
    old = before.quantiles[Metric.PEAK_JERK].share_95
    new = after.quantiles[Metric.PEAK_JERK].share_95
    tiles = [
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


def _build_limits(found: Calibration) -> TableBlock:
    head = (*make_cells("metric", "for"), *make_cells("limit", "value", "upper", number=True),
            *make_cells("state"))  # fmt: skip
    rows = [_build_limit_row(one) for one in found.after.certificate.limits]
    return TableBlock("Limits; the upper bound holds with the stated confidence", head, rows)


def _build_limit_row(one: LimitCheck) -> tuple[Cell, ...]:
    display = get_metric_display(one.limit.metric)
    upper = "–" if one.upper is None else f"{one.upper * display.factor:.4g}"
    return (
        *make_cells(METRICS[one.limit.metric].label, one.limit.statistic.value),
        Cell(f"{one.limit.bound * display.factor:.4g} {display.label}", number=True),
        Cell(f"{one.value * display.factor:.4g}", number=True),
        Cell(upper, number=True),
        Cell(one.text, badge=True, tone=_TONES[one.state]),
    )


def _describe_confidence(found: Calibration) -> str:
    one = found.after.certificate
    return (
        f"Upper bounds by order statistics of {one.draws} draws hold with "
        f"{100.0 * one.confidence:.0f} % confidence; so does: {100.0 * one.worst_share:.2f} % of "
        "all units stay below the worst value drawn. Only the stated spread and the identified "
        "covariance are drawn: other temperatures and wear are not."
    )


def _build_statistics(found: Calibration) -> TableBlock:
    names = ("median", "mean", "95 %", "upper", "99 %", "upper", "worst")
    head = (*make_cells("metric", ""), *make_cells(*names, number=True))
    rows = []
    for metric, spec in METRICS.items():
        display = get_metric_display(metric)
        for part, one in (("before", found.before), ("after", found.after)):
            q = one.certificate.quantiles[metric]
            values = (
                *(q.median, q.mean, q.share_95, q.upper_95),
                *(q.share_99, q.upper_99, q.worst),
            )
            texts = ("–" if v is None else f"{v * display.factor:.4g}" for v in values)
            label = f"{spec.label} [{display.label}]" if part == "before" else ""
            rows.append((*make_cells(label, part), *make_cells(*texts, number=True)))
    return TableBlock("Metrics over the fresh draws", head, rows)


def _build_locks(found: Calibration) -> TableBlock:
    head = (*make_cells("event", ""), *make_cells("draws", "upper bound of share", number=True))
    rows = []
    for part, one in (("before", found.before.certificate), ("after", found.after.certificate)):
        for label, count, bound in (
            ("no lock-up", one.unlocked, one.unlocked_upper),
            ("slips again after lock-up", one.relocked, one.relocked_upper),
        ):
            numbers = make_cells(str(count), f"{100.0 * bound:.2f} %", number=True)
            rows.append((*make_cells(label, part), *numbers))
    return TableBlock("Events of the on-coming element", head, rows)


def _build_values(found: Calibration) -> TableBlock:
    head = (*make_cells("parameter", "unit"), *make_cells("before", "after", "low", "high",
            number=True), *make_cells("meaning"))  # fmt: skip
    rows = []
    parameters = found.task.policy.parameters
    for one, old, new in zip(parameters, found.before.values, found.after.values, strict=True):
        numbers = (f"{value:.5g}" for value in (old, new, one.low, one.high))
        unit = spell_unit(one.unit)
        rows.append((*make_cells(one.name, unit), *make_cells(*numbers, number=True),
                     *make_cells(one.text if one.free else f"{one.text} (kept)")))  # fmt: skip
    return TableBlock("Parameters of the policy, SI", head, rows)


def _build_definitions() -> TableBlock:
    rows = [
        make_cells(one.label, spell_unit(one.unit), one.definition, one.source)
        for one in METRICS.values()
    ]
    return TableBlock("Metrics", make_cells("metric", "unit", "definition", "source"), rows)
