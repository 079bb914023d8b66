# SPDX-License-Identifier: MIT
"""Panels of figures lie where plotly puts them."""

from __future__ import annotations

import pytest
from plotly import subplots

from drivetwin.report.figure import make_subplots


def test_panels_lie_where_plotly_puts_them() -> None:
    ours = make_subplots([0.64, 0.36], [0.62, 0.38], gaps=(0.12, 0.2))
    theirs = subplots.make_subplots(
        rows=2,
        cols=2,
        column_widths=[0.64, 0.36],
        row_heights=[0.62, 0.38],
        horizontal_spacing=0.12,
        vertical_spacing=0.2,
    )
    axes = [name for name in ours.layout if name.startswith(("xaxis", "yaxis"))]
    assert len(axes) == 8
    for name in axes:
        assert ours.layout[name].domain == pytest.approx(theirs.layout[name].domain)
        assert ours.layout[name].anchor == theirs.layout[name].anchor


def test_titles_stand_above_their_panels_as_those_of_plotly() -> None:
    ours = make_subplots([1.0, 1.0], [1.0, 1.0], gaps=(0.1, 0.25), titles=("a", "b", "c", "d"))
    theirs = subplots.make_subplots(rows=2, cols=2, subplot_titles=("a", "b", "c", "d"))
    for one, other in zip(ours.layout.annotations, theirs.layout.annotations, strict=True):
        assert (one.text, one.x, one.y) == (other.text, *map(pytest.approx, (other.x, other.y)))
