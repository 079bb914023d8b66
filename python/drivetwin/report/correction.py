# SPDX-License-Identifier: MIT
"""Correction of a twin by logs of one vehicle, as blocks."""

from __future__ import annotations

from drivetwin._util.display_units import NM, RPM, spell_unit
from drivetwin.calibration.calibrate import Calibration
from drivetwin.calibration.learn import Correction, LoggedFit
from drivetwin.calibration.metrics import Metric
from drivetwin.estimation.result.estimate import Z95
from drivetwin.report.blocks import (
    Block,
    FigureBlock,
    TableBlock,
    Tile,
    TilesBlock,
    Tone,
    make_table,
)
from drivetwin.report.figure import MEASURED, MUTED, SIMULATED
from drivetwin.report.figures.stack import Curve, Panel, compute_full_range, plot_over_time_axis

_FEWEST_MOVED = 0.01
"""Narrowing of an interval below which the logs say nothing of a value [ratio]."""


def build_correction_blocks(found: Correction, next_one: Calibration) -> list[Block]:
    """Gain to expect, fit of the logged shifts, and the learned values with their intervals.

    `next_one` is the calibration on the corrected twin, whose start is an earlier one.
    """
    tables = [_build_fit(found), _build_values(found)]
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


def _build_values(found: Correction) -> TableBlock:
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
