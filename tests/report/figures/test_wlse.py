# SPDX-License-Identifier: MIT
"""Scatter and error of the grid search."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.estimation.paper.wlse import GridFit, GridRow
from drivetwin.report.figures.wlse import plot_wlse
from drivetwin.report.sections.stage_results import INERTIA_LABELS, build_grid_table


def _fit() -> GridFit:
    rows = (GridRow(1.0, 23.2, 523.2), GridRow(0.85, 17.5, 273.9), GridRow(0.7, 12.6, 515.7))
    acceleration = np.linspace(-5.0, 5.0, 50)
    weights = np.where(np.abs(acceleration) > 1.0, 1.0, 0.01)
    torque = 17.5 * acceleration
    return GridFit(rows, rows[1], acceleration, torque, torque + 200.0, weights)


def test_line_has_the_inertia_as_its_slope() -> None:
    figure = plot_wlse(_fit(), INERTIA_LABELS)
    line = next(trace for trace in figure.data if trace.mode == "lines")
    assert np.ptp(line.y) / np.ptp(line.x) == pytest.approx(17.5)
    assert "J′ = 17.5" in line.name


def test_every_sample_is_drawn_once_at_the_best_value() -> None:
    figure = plot_wlse(_fit(), INERTIA_LABELS)
    start, outside, inside = figure.data[:3]
    assert len(outside.x) + len(inside.x) == len(start.x) == 50


def test_table_marks_the_row_of_least_error() -> None:
    table = build_grid_table(_fit(), INERTIA_LABELS)
    marked = [row[0].text for row in table.rows if row[3].text]
    assert marked == ["0.85"]
    assert [cell.text for cell in table.head[:2]] == ["η [–]", "J′ [kg·m²]"]
