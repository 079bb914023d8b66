# SPDX-License-Identifier: MIT
"""Stacked time panels: one time axis, phases marked, peaks kept, display units."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from drivetwin._util.display_units import BAR, NM, RPM
from drivetwin.report.figures.recording import get_shift_spans, plot_shift_phases
from drivetwin.report.figures.stack import (
    Curve,
    Panel,
    compute_y_ranges,
    plot_over_time_axis,
    stack_panels,
)
from drivetwin.report.figures.validation import plot_validation
from drivetwin.report.style import MEASURED, SIMULATED
from tests.report.sample import SHIFT, TIME, log, validation


def test_panels_share_time_and_do_not_overlap() -> None:
    figure = plot_shift_phases(log(), SHIFT)
    assert {trace.xaxis for trace in figure.data} == {"x"}
    names = [name for name in figure.layout if name.startswith("yaxis")]
    domains = sorted(tuple(figure.layout[name].domain) for name in names)
    assert all(low[1] < high[0] for low, high in pairwise(domains))
    assert (domains[0][0], domains[-1][1]) == pytest.approx((0.0, 1.0))


def test_phases_are_marked_where_they_are() -> None:
    figure = plot_shift_phases(log(), SHIFT)
    bands = [(shape.x0, shape.x1) for shape in figure.layout.shapes]
    assert bands == [SHIFT.torque_phase, SHIFT.inertia_phase]
    assert [note.text for note in figure.layout.annotations] == [
        "<b>1</b>",
        "<b>2</b>",
        "<b>3</b>",
        "<b>4</b>",
    ]


def test_view_opens_on_the_shift_and_buttons_zoom() -> None:
    figure = plot_shift_phases(log(), SHIFT)
    assert tuple(figure.layout.xaxis.range) == pytest.approx((0.5, 2.6))
    buttons = {b.label: b.args[0]["xaxis.range"] for b in figure.layout.updatemenus[0].buttons}
    assert buttons["whole"] == pytest.approx([0.0, 2.999])
    assert buttons["inertia phase"] == pytest.approx([1.16, 1.64])


def test_values_are_shown_in_display_units() -> None:
    curves = [Curve("P", TIME, np.full_like(TIME, 5e5), MEASURED)]
    speeds = [Curve("n", TIME, np.full_like(TIME, np.pi), MEASURED)]
    panels = [Panel("pressure", BAR, curves), Panel("speed", RPM, speeds)]
    pressure, speed = stack_panels(panels, get_shift_spans(SHIFT), 400).data
    assert pressure.y[0] == pytest.approx(5.0)
    assert speed.y[0] == pytest.approx(30.0)


def test_measured_and_simulated_keep_their_colours() -> None:
    figure = plot_validation(validation())
    colours = {trace.name: trace.line.color for trace in figure.data}
    assert colours["measured"] == MEASURED
    assert colours["simulated"] == SIMULATED


def test_residual_is_measured_minus_simulated() -> None:
    figure = plot_validation(validation())
    residual = next(trace for trace in figure.data if trace.name.startswith("measured −"))
    assert np.mean(residual.y) == pytest.approx(-20.0, abs=1.0)


def test_axes_show_what_is_in_view() -> None:
    values = np.where(TIME < 1.0, 5e5, 9e5)
    panels = [Panel("pressure", BAR, [Curve("P", TIME, values, MEASURED)])]
    (low, high) = compute_y_ranges(panels, (0.0, 0.9))["yaxis"]
    assert low < 5.0 < high < 9.0
    assert compute_y_ranges(panels, (0.0, 2.0))["yaxis"] == pytest.approx((4.76, 9.24))


def test_what_hardly_moves_is_not_blown_up() -> None:
    noise = 100.0 + 1e-3 * np.random.default_rng(1).standard_normal(TIME.size)
    panels = [Panel("torque", NM, [Curve("T", TIME, noise, MEASURED)])]
    low, high = compute_y_ranges(panels, (0.0, 2.0))["yaxis"]
    assert high - low > 4.0


def test_an_empty_view_has_no_range() -> None:
    panels = [Panel("torque", NM, [Curve("T", TIME, np.full_like(TIME, np.nan), MEASURED)])]
    assert compute_y_ranges(panels, (0.0, 2.0)) == {}
    assert "range" not in plot_over_time_axis(panels, (0.0, 2.0), 300).layout.yaxis


def test_late_in_a_long_recording_samples_keep_their_distance() -> None:
    time = np.linspace(50_000.0, 50_000.999, 1000)
    panel = Panel("torque", NM, [Curve("T_e", time, np.sin(time), MEASURED)])
    drawn = np.asarray(plot_over_time_axis([panel], (time[0], time[-1]), 300).data[0].x, np.float64)
    assert np.diff(drawn) == pytest.approx(np.full(999, 1e-3), rel=0.1)


def test_a_held_value_counts_until_the_next() -> None:
    curve = Curve("T", np.array([0.0, 1.0]), np.array([5.0, 9.0]), MEASURED, step=True)
    low, high = compute_y_ranges([Panel("torque", NM, [curve])], (0.4, 0.6))["yaxis"]
    assert low < 5.0 < high < 9.0
