# SPDX-License-Identifier: MIT
"""Lock-up oscillation: fit with residual, or the extremes that were read."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from drivetwin.estimation.linear.ringdown import RingDown
from drivetwin.report.blocks import FigureBlock
from drivetwin.report.embedded_data import Store
from drivetwin.report.figures.ringdown import build_ringdown_panels, plot_ringdown
from drivetwin.report.html import encode_figure


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
    block = FigureBlock(plot_ringdown(read), "", build_ringdown_panels(read))
    measured, extremes = json.loads(encode_figure(block, store))["data"]
    assert "x" not in measured
    assert "y" not in measured
    assert len(store.index) == 2
    assert extremes["name"] == "extremes of 10 ms means"
    assert "x" in extremes
