# SPDX-License-Identifier: MIT
"""Observed torques: the band is an area about the curve that can be seen."""

from __future__ import annotations

import numpy as np

from drivetwin._util.display_units import NM
from drivetwin.estimation.result.estimate import Z95
from drivetwin.observer.result import Band
from drivetwin.report.figures.stack import Panel, plot_over_time_axis
from drivetwin.report.observer import _build_band_curves


def test_the_band_is_filled_between_its_bounds_and_named_once() -> None:
    time = np.linspace(0.0, 1.0, 50)
    band = Band(np.sin(time), np.full(50, 0.1))
    figure = plot_over_time_axis(
        [Panel("torque", NM, _build_band_curves(time, band))], (0.0, 1.0), 300
    )
    low, high, curve = figure.data
    assert (low.fill, high.fill, curve.fill) == (None, "tonexty", None)
    assert np.allclose(np.subtract(high.y, low.y), 2.0 * Z95 * 0.1, rtol=1e-3)
    assert high.fillcolor.startswith("rgba")
    assert [trace.name for trace in figure.data if trace.showlegend] == ["95 % band", "observed"]
    assert high.hovertemplate.startswith("to ")
