# SPDX-License-Identifier: MIT
"""Lock-up oscillation: fit with residual, or the extremes that were read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.identify.ringdown import RingDown
from drivetwin.report.figures.ringdown import ringdown_figure


def _ring() -> RingDown:
    time = np.linspace(0.0, 1.0, 500)
    torque = 1900.0 + 300.0 * np.exp(-4.5 * time) * np.cos(75.0 * time)
    nothing = np.empty(0)
    return RingDown(4.5, 75.0, np.zeros((2, 2)), time, torque, torque - 3.0, nothing, nothing)


def test_residual_stands_under_the_fit() -> None:
    figure = ringdown_figure(_ring())
    measured, fitted, residual = figure.data
    assert (measured.name, fitted.name) == ("measured", "fitted")
    assert residual.y == pytest.approx(np.full(500, 3.0))
    assert residual.yaxis == "y2"


def test_extremes_are_marked() -> None:
    read = replace(_ring(), extremes_time=np.array([0.04]), extremes_torque=np.array([1650.0]))
    figure = ringdown_figure(read)
    assert [trace.mode for trace in figure.data] == [None, "markers"]
    assert figure.data[1].y == pytest.approx([1650.0])
