# SPDX-License-Identifier: MIT
"""Figures of the stages: grid search and lock-up oscillation."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from drivetwin.estimation.linear.ringdown import RingDown
from drivetwin.estimation.paper.wlse import GridFit, GridRow
from drivetwin.report.blocks import FigureBlock
from drivetwin.report.figures.stage_results import plot_ringdown, plot_wlse
from drivetwin.report.html import Store, encode_figure
from drivetwin.report.sections.stage_results import INERTIA_LABELS


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


def _ring() -> RingDown:
    time = np.linspace(0.0, 1.0, 500)
    torque = 1900.0 + 300.0 * np.exp(-4.5 * time) * np.cos(75.0 * time)
    nothing = np.empty(0)
    return RingDown(4.5, 75.0, np.zeros((2, 2)), time, torque, torque - 3.0, nothing, nothing)


def test_residual_stands_under_the_fit() -> None:
    figure = plot_ringdown(_ring())
    measured, fitted, residual = figure.data
    assert (measured.name, fitted.name) == ("measured", "fitted")
    assert residual.y == pytest.approx(np.full(500, 3.0))
    assert residual.yaxis == "y2"


def test_extremes_are_marked() -> None:
    read = replace(_ring(), extremes_time=np.array([0.04]), extremes_torque=np.array([1650.0]))
    figure = plot_ringdown(read)
    assert [trace.mode for trace in figure.data] == ["lines", "markers"]
    assert [trace.showlegend for trace in figure.data] == [True, True]
    assert figure.data[1].y == pytest.approx([1650.0])


def test_the_page_packs_the_samples_and_keeps_the_extremes() -> None:
    """The samples are most of a report of many shifts; the marks stand behind them in the data."""
    read = replace(_ring(), extremes_time=np.array([0.04]), extremes_torque=np.array([1650.0]))
    store = Store()
    block = FigureBlock(plot_ringdown(read), "")
    measured, extremes = json.loads(encode_figure(block, store))["data"]
    assert "x" not in measured
    assert "y" not in measured
    assert len(store.index) == 2
    assert extremes["name"] == "extremes of 10 ms means"
    assert "x" in extremes
