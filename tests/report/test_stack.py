# SPDX-License-Identifier: MIT
"""Figures of logs and simulations: one time axis, phases marked, peaks kept, display units."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivetwin.report.stack import decimate_around, extract_envelope
from tests.report.sample import SHIFT, TIME, list_blocks, log, simulated, validation


@pytest.fixture(scope="module")
def phases() -> Any:
    """The figure of the shift with its phases."""
    (block,) = list_blocks(simulated(), "shift", "figure")
    return block.figure


def test_panels_share_time_do_not_overlap_and_mark_the_phases(phases: Any) -> None:
    assert {trace.xaxis for trace in phases.data} == {"x"}
    names = [name for name in phases.layout if name.startswith("yaxis")]
    domains = sorted(tuple(phases.layout[name].domain) for name in names)
    assert all(low[1] < high[0] for low, high in pairwise(domains))
    assert (domains[0][0], domains[-1][1]) == pytest.approx((0.0, 1.0))
    bands = [(shape.x0, shape.x1) for shape in phases.layout.shapes]
    assert bands == [SHIFT.torque_phase, SHIFT.inertia_phase]


def test_the_view_opens_on_the_shift_and_shows_all_samples_in_it(phases: Any) -> None:
    start, end = phases.layout.xaxis.range
    assert (start, end) == pytest.approx((0.5, 2.6))
    buttons = {b.label: b.args[0]["xaxis.range"] for b in phases.layout.updatemenus[0].buttons}
    assert buttons["whole"] == pytest.approx([0.0, 2.999])
    for trace in phases.data:
        axis = phases.layout[trace.yaxis.replace("y", "yaxis")]
        if "range" not in axis:
            continue
        x, y = np.asarray(trace.x), np.asarray(trace.y)
        seen = y[(x >= start) & (x <= end)]
        low, high = axis.range
        assert low <= np.nanmin(seen) <= np.nanmax(seen) <= high
        # What hardly moves is not blown up.
        assert high - low > 0.02 * np.nanmax(np.abs(seen))


def test_values_are_shown_in_display_units() -> None:
    figure = log().plot()
    largest = {trace.name: float(np.nanmax(trace.y)) for trace in figure.data}
    assert largest["pressure B2"] == pytest.approx(14.0, rel=0.01)
    assert largest["input speed"] == pytest.approx(178.0 * 30.0 / np.pi, rel=0.01)
    assert tuple(figure.layout.xaxis.range) == (0.0, 2.999)


def test_the_residual_is_measured_minus_simulated() -> None:
    figure = validation().plot()
    residual = next(trace for trace in figure.data if trace.name.startswith("measured −"))
    assert np.mean(residual.y) == pytest.approx(-20.0, abs=1.0)
    colours = {trace.name: trace.line.color for trace in figure.data}
    assert colours["measured"] != colours["simulated"]


@pytest.mark.parametrize("factor", [1.0, 4.0])
def test_large_torques_are_shown_in_kilo(factor: float) -> None:
    one = validation()
    trace = one.traces["output_torque"]
    grown = replace(trace, measured=factor * trace.measured, simulated=factor * trace.simulated)
    figure = replace(one, traces={**one.traces, "output_torque": grown}).plot()
    assert ("[kNm]" in str(figure.layout)) is (factor > 1.0)


def test_the_band_of_friction_encloses_its_curve() -> None:
    (block,) = list_blocks(simulated(), "friction", "figure")
    traces = {trace.name: trace for trace in block.figure.data}
    band, curve = traces["95 % band, sensors and effects"], traces["curve of B3"]
    half = len(band.y) // 2
    assert np.all(band.y[:half] > curve.y)
    assert np.all(band.y[half:][::-1] < curve.y)
    nothing = np.full(60, np.nan)
    bare = replace(simulated().friction["B3"], mu_lo=nothing, mu_hi=nothing, stribeck=None)
    (block, *_) = list_blocks(replace(simulated(), friction={"B3": bare}), "friction", "figure")
    assert [trace.name for trace in block.figure.data] == ["points from the log", "curve of B3"]


def test_a_held_element_has_no_measured_slip() -> None:
    one = validation()
    start, lockup = SHIFT.torque_phase[0], SHIFT.lockup_time + 0.01
    held = {"B2": np.less(TIME, start), "B3": np.greater(TIME, lockup)}
    run = replace(one.trajectory, slip={name: np.zeros(TIME.size) for name in held})
    figures = list_blocks(simulated(replace(one, trajectory=run)), "validation", "figure")
    panels = {panel.quantity: panel for each in figures for panel in each.figure.panels}
    for name, inside in held.items():
        (measured,) = [c for c in panels[f"slip of {name}"].curves if c.name == "measured"]
        assert np.mean(measured.values[inside]) == pytest.approx(0.0, abs=0.5)
        assert np.abs(np.mean(measured.values[~inside])) > 5.0


@settings(max_examples=30)
@given(size=st.integers(1, 3000), limit=st.integers(8, 400), seed=st.integers(0, 99))
def test_envelope_is_a_subset_with_all_extremes(size: int, limit: int, seed: int) -> None:
    time = np.arange(size, dtype=float)
    values = np.random.default_rng(seed).standard_normal(size)
    kept_time, kept = extract_envelope(time, values, limit)
    assert kept_time.size <= max(limit, 8)
    assert np.all(np.diff(kept_time) > 0)
    assert np.array_equal(values[kept_time.astype(int)], kept)
    assert (kept.min(), kept.max()) == (values.min(), values.max())
    assert (kept_time[0], kept_time[-1]) == (0.0, size - 1.0)


def test_spike_between_gaps_survives_and_a_focus_keeps_its_samples() -> None:
    time = np.arange(50_000, dtype=float)
    values = np.full(time.size, np.nan)
    values[20_000:30_000] = 0.0
    values[25_123] = 9.0
    kept_time, kept = extract_envelope(time, values)
    assert kept_time[np.nanargmax(kept)] == 25_123.0
    assert np.isnan(kept[0])
    time = np.arange(0.0, 200.0, 1e-3)
    values = np.sin(75.0 * time)
    kept_time, kept = decimate_around(time, values, (100.0, 102.0))
    inside = (time >= 100.0) & (time < 102.0)
    assert np.isin(time[inside], kept_time).all()
    assert np.all(np.diff(kept_time) > 0)
    assert kept.max() == values.max()
