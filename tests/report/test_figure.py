# SPDX-License-Identifier: MIT
"""Figures as plain data: what plotly makes of them, and how they are packed."""

from __future__ import annotations

import base64
import json

import numpy as np
import pytest
from plotly import subplots

from drivetwin.report.figure import Entry, Figure, encode_entries, make_subplots, make_trace


def test_panels_lie_where_plotly_puts_them() -> None:
    ours = make_subplots([0.64, 0.36], [0.62, 0.38], gaps=(0.12, 0.2), tall=[(1, 2)])
    theirs = subplots.make_subplots(
        rows=2,
        cols=2,
        specs=[[{}, {"rowspan": 2}], [{}, None]],
        column_widths=[0.64, 0.36],
        row_heights=[0.62, 0.38],
        horizontal_spacing=0.12,
        vertical_spacing=0.2,
    )
    axes = [name for name in ours.layout if name.startswith(("xaxis", "yaxis"))]
    assert len(axes) == 6
    for name in axes:
        assert ours.layout[name].domain == pytest.approx(theirs.layout[name].domain)
        assert ours.layout[name].anchor == theirs.layout[name].anchor


def test_titles_stand_above_their_panels_as_those_of_plotly() -> None:
    ours = make_subplots([1.0, 1.0], [1.0, 1.0], gaps=(0.1, 0.25), titles=("a", "b", "c", "d"))
    theirs = subplots.make_subplots(rows=2, cols=2, subplot_titles=("a", "b", "c", "d"))
    for one, other in zip(ours.layout.annotations, theirs.layout.annotations, strict=True):
        assert (one.text, one.x, one.y) == (other.text, *map(pytest.approx, (other.x, other.y)))


def test_traces_and_lines_belong_to_their_panel() -> None:
    figure = make_subplots([1.0, 1.0])
    figure.add_scatter(x=[1.0], y=[2.0], name=None, row=1, col=2)
    figure.add_vline(0.5, {"width": 1}, row=1, col=2)
    figure.update_axes("x", {"ticks": ""}, col=2)
    assert figure.data == [
        {"type": "scatter", "x": [1.0], "y": [2.0], "xaxis": "x2", "yaxis": "y2"}
    ]
    assert (figure.layout.shapes[0].xref, figure.layout.shapes[0].yref) == ("x2", "y2 domain")
    assert figure.layout.xaxis2.ticks == ""
    assert figure.layout.xaxis.ticks is None
    assert figure.to_plotly().layout.xaxis2.ticks == ""


def test_tables_of_the_layout_are_merged_and_the_source_stays() -> None:
    source = {"margin": {"l": 1, "t": 2}}
    figure = Figure(layout=source)
    figure.merge_layout(margin={"t": 3}, height=10)
    assert figure.layout == {"margin": {"l": 1, "t": 3}, "height": 10}
    assert source == {"margin": {"l": 1, "t": 2}}


def test_arrays_are_packed_and_all_is_strict_json() -> None:
    grid = np.array([[1.0, np.nan, 3.0]], np.float32)
    trace = make_trace(
        "heatmap", z=grid, y=[np.float64(2.0), np.nan], x=np.array(["2026-11-26"], "M8[D]")
    )
    document = json.loads(json.dumps(encode_entries(trace), allow_nan=False))
    values = np.frombuffer(base64.b64decode(document["z"]["bdata"]), "<f4")
    assert (document["z"]["dtype"], document["z"]["shape"]) == ("f4", "1, 3")
    assert np.array_equal(values, grid[0], equal_nan=True)
    assert document["y"] == [2.0, None]
    assert document["x"] == ["2026-11-26"]
    assert encode_entries(Entry(n=np.arange(2), k=np.int64(3))) == {"n": [0, 1], "k": 3}
