# SPDX-License-Identifier: MIT
"""Figures of shift quality of a whole drive, by gears and kind of shift."""

from __future__ import annotations

from collections.abc import Sequence

from drivetwin._util.display_units import get_display_unit
from drivetwin.report.figure import Figure
from drivetwin.report.style import get_candidate_style, make_axis, make_layout
from drivetwin.shifts.quality import QUALITY_UNITS
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.shift_kind import ShiftKind


def plot_quality(name: str, shifts: Sequence[Shift]) -> Figure:
    """One figure of shift quality over the pairs of gears: a point for each shift.

    Parameters
    ----------
    name : a key of `QUALITY_UNITS`
    shifts : shifts of the drive; those without the figure are left out
    """
    display = get_display_unit(QUALITY_UNITS[name])
    shown = [one for one in shifts if name in one.quality]
    by_gear = sorted(
        shown, key=lambda one: (not one.kind.is_up, len(one.start_gear), one.start_gear)
    )
    order = list(dict.fromkeys(_format_gears(one) for one in by_gear))
    figure = Figure()
    for k, kind in enumerate(one for one in ShiftKind if any(s.kind is one for s in shown)):
        alike = [one for one in shown if one.kind is kind]
        style = get_candidate_style(k)
        figure.add_scatter(
            x=[_format_gears(one) for one in alike],
            y=[display.factor * one.quality[name] for one in alike],
            mode="markers",
            name=kind.value,
            text=[f"{one.lockup_time:.2f} s" for one in alike],
            marker={"color": style.colour, "symbol": style.symbol, "size": 8},
            hovertemplate=f"%{{x}}: %{{y:.3g}} {display.label}, lock-up at %{{text}}"
            f"<extra>{kind.value}</extra>",
        )
    label = name.replace("_", " ")
    figure.set_layout(
        make_layout(
            300,
            xaxis=make_axis("gears", type="category", categoryorder="array", categoryarray=order),
            yaxis=make_axis(f"{label} [{display.label}]", rangemode="tozero"),
            showlegend=True,
        )
    )
    return figure


def _format_gears(shift: Shift) -> str:
    return f"{shift.start_gear}→{shift.end_gear}"
