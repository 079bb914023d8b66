# SPDX-License-Identifier: MIT
"""μ over slip: the band closes, a missing band or law is left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.report.figures.comparison import plot_friction_overlay
from drivetwin.report.figures.friction import plot_friction
from tests.report.sample import friction


def test_band_encloses_the_curve() -> None:
    figure = plot_friction("B3", friction())
    traces = {trace.name: trace for trace in figure.data}
    band, curve = traces["95 % band, sensors and effects"], traces["curve of B3"]
    half = len(band.y) // 2
    assert np.all(band.y[:half] > curve.y)
    assert np.all(band.y[half:][::-1] < curve.y)
    assert traces["Stribeck law"].y == pytest.approx(curve.y)


def test_curve_without_interval_or_law_is_still_drawn() -> None:
    nothing = np.full(60, np.nan)
    bare = replace(friction(), mu_lo=nothing, mu_hi=nothing, stribeck=None)
    figure = plot_friction("B3", bare)
    assert [trace.name for trace in figure.data] == ["points from the log", "curve of B3"]
    low, high = figure.layout.yaxis.range
    assert low < bare.mu.min() < bare.mu.max() < high


def test_a_curve_over_eta_says_so_on_its_axis() -> None:
    told = friction()
    ratio = replace(told, over_eta=True)
    titles = [plot_friction("B3", one).layout.yaxis.title.text for one in (told, ratio)]
    assert titles == ["friction coefficient μ [–]", "friction coefficient μ/η [–]"]
    overlay = plot_friction_overlay("B3", {"a": told, "b": ratio}, ["a", "b"])
    assert [one.name for one in overlay.data if one.name] == ["a", "b (μ/η)"]
