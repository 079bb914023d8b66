# SPDX-License-Identifier: MIT
"""Figures of a fleet show what the estimate says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.fleet.figures import format_unit, plot_drift, plot_units
from drivetwin.fleet.mixed_model.result import (
    Change,
    Drift,
    JointEstimate,
    Outlier,
    Points,
    UnitValue,
)


@pytest.fixture
def one() -> JointEstimate:
    """P0 of two units, one of which changed; one stray log."""
    reading = np.array([0.0, 50.0, 100.0, 150.0])
    value = np.array([8.0e4, 8.2e4, 9.9e4, 8.6e4])
    points = Points(reading, value, np.full(4, 1e3), ("a", "b", "a", "b"))
    stray = Outlier("k", "/l/k.csv", "a", 9.9e4, 8.4e4, 15.0, "")
    return JointEstimate(
        "P0.B3", "r", "Pa", 4, 0, 8.3e4, (8.2e4, 8.4e4), 1e3, (0.0, 2e3), 1.0,
        (Drift("odometer_Mm", 40.0, (30.0, 50.0), 75.0),),
        (UnitValue("a", 2, -1e3, 500.0, None, -1.0, False),
         UnitValue("b", 1, 1e3, 500.0, None, 1.0, False),
         UnitValue("b", 1, 9e3, 500.0, 120.0, 9.0, True)),
        (Change("b", "odometer_Mm", 100.0, 150.0, 8e3, 700.0),), (stray,), (), points,
    )  # fmt: skip


def test_every_log_is_drawn_and_the_line_goes_through_the_reference(one: JointEstimate) -> None:
    figure = plot_drift(one)
    assert len(figure.to_plotly().data) == len(figure.data)
    traces = {trace.name: trace for trace in figure.data}
    assert list(traces["log"].x) == [0.0, 50.0]
    assert list(traces["unit that changed, from there"].x) == [150.0]
    assert list(traces["outlier"].y) == [pytest.approx(0.99)]
    line = traces["fleet"]
    at = np.interp(75.0, line.x, line.y)
    assert at == pytest.approx(0.83)
    assert (line.y[-1] - line.y[0]) == pytest.approx(150.0 * 40.0 * 1e-5)
    assert len(figure.layout.shapes) == 1
    assert figure.layout.shapes[0].x0 == 125.0
    assert "bar" in figure.layout.yaxis.title.text


def test_dates_are_drawn_as_dates(one: JointEstimate) -> None:
    dated = replace(one, drifts=(replace(one.drifts[0], field="date"),), changes=())
    first = plot_drift(dated).data[0]
    assert str(first.x[0]).startswith("1970-01-01")


def test_units_are_sorted_and_odd_ones_stand_out(one: JointEstimate) -> None:
    usual, odd = plot_units(one).data
    assert list(usual.text) == ["a", "b"]
    assert list(odd.text) == ["b from 120"]
    assert odd.y[0] == pytest.approx(0.09)
    assert format_unit(one, one.units[0]) == "a"
