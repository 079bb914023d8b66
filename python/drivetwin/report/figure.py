# SPDX-License-Identifier: MIT
"""Figures as plain data in the form that plotly.js draws: traces and a layout.

The Python library of plotly checks every entry, which takes longer than all else of a page. It is
imported where a notebook shows a figure; the tests check all figures with it.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np
    import plotly.graph_objects as go


class Entry(dict[str, Any]):
    """Part of a figure. Its entries are attributes as well; an absent one is None."""

    def __init__(self, entries: Mapping[str, Any] | None = None, **more: Any) -> None:
        both = {**(entries or {}), **more}
        super().__init__({key: _wrap(value) for key, value in both.items() if value is not None})

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return self.get(name)

    def merge(self, changes: Mapping[str, Any]) -> None:
        """Set entries; where both sides are tables, those of the table."""
        for key, value in Entry(changes).items():
            old = self.get(key)
            if isinstance(old, Entry) and isinstance(value, Entry):
                old.merge(value)
            else:
                self[key] = value


def _wrap(value: Any) -> Any:
    if isinstance(value, Mapping):
        return Entry(value)
    if isinstance(value, list | tuple):
        return [_wrap(one) for one in value]
    return value


def make_trace(kind: str, **entries: Any) -> Entry:
    """Return a trace of a kind, `scatter`, `heatmap`, `bar` or `histogram`; None: no entry."""
    return Entry(type=kind, **entries)


class Figure:
    """Traces in `data` and a `layout`; with several panels, cells by row and column from 1 on."""

    def __init__(
        self, traces: Entry | Iterable[Entry] = (), layout: Mapping[str, Any] | None = None
    ) -> None:
        self.data: list[Entry] = [traces] if isinstance(traces, Entry) else list(traces)
        self.layout = Entry(layout)
        self.panels: Sequence[Any] = ()
        """Of a figure over time the panels with all samples; `data` begins with their curves."""
        self._suffixes: dict[tuple[int, int], str] = {(1, 1): ""}

    def set_layout(self, entries: Mapping[str, Any]) -> None:
        """Replace the layout."""
        self.layout = Entry(entries)

    def add_trace(self, trace: Entry, row: int = 1, col: int = 1) -> None:
        """Add a trace to a cell."""
        suffix = self._suffixes[row, col]
        if len(self._suffixes) > 1:
            trace |= {"xaxis": f"x{suffix}", "yaxis": f"y{suffix}"}
        self.data.append(trace)

    def add_scatter(self, row: int = 1, col: int = 1, **entries: Any) -> None:
        """Add curves or points to a cell."""
        self.add_trace(make_trace("scatter", **entries), row, col)

    def add_shape(self, **entries: Any) -> None:
        """Add a line or rectangle."""
        self.layout.setdefault("shapes", []).append(Entry(entries))

    def add_annotation(self, **entries: Any) -> None:
        """Add a text."""
        self.layout.setdefault("annotations", []).append(Entry(entries))

    def add_vline(self, x: float, line: Mapping[str, Any], row: int = 1, col: int = 1) -> None:
        """Add a vertical line through a cell."""
        suffix = self._suffixes[row, col]
        axes = {"xref": f"x{suffix}", "yref": f"y{suffix} domain"}
        self.add_shape(type="line", x0=x, x1=x, y0=0, y1=1, line=line, **axes)

    def merge_layout(self, **entries: Any) -> None:
        """Set entries of the layout, those of axes one by one."""
        self.layout.merge(entries)

    def update_axes(self, letter: str, entries: Mapping[str, Any], col: int | None = None) -> None:
        """Set entries of the `x` or `y` axes of a column, or of all."""
        for (_, column), suffix in self._suffixes.items():
            if col in (None, column):
                self.layout.merge({f"{letter}axis{suffix}": entries})

    def split(self, suffixes: Mapping[tuple[int, int], str], layout: Mapping[str, Any]) -> None:
        """Take over cells, by row and column the suffix of their axes, and the layout of these."""
        self._suffixes = dict(suffixes)
        self.layout = Entry(layout)

    def to_document(self) -> dict[str, Any]:
        """Return traces and layout for JSON, with arrays packed as plotly.js reads them."""
        return {"data": encode_entries(self.data), "layout": encode_entries(self.layout)}

    def to_plotly(self) -> go.Figure:
        """Return the figure as an object of plotly, which checks all entries."""
        import plotly.graph_objects as go

        return go.Figure(self.data, {**self.layout, "template": go.layout.Template()})


def encode_entries(value: Any) -> Any:
    """Convert entries to what JSON knows: arrays packed, numbers that are not finite null."""
    import numpy as np  # here, because commands import the blocks before they run

    if isinstance(value, Mapping):
        return {key: encode_entries(one) for key, one in value.items()}
    if isinstance(value, np.ndarray):
        return _encode_array(value)
    if isinstance(value, list | tuple):
        return [encode_entries(one) for one in value]
    if isinstance(value, np.datetime64):
        return str(value)
    if isinstance(value, np.generic):
        return encode_entries(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _encode_array(values: np.ndarray[Any, Any]) -> Any:
    if values.dtype.kind != "f":
        return encode_entries(list(values))
    kind = "f4" if values.dtype.itemsize <= 4 else "f8"
    packed = base64.b64encode(values.astype(f"<{kind}").tobytes()).decode("ascii")
    shape = {"shape": ", ".join(map(str, values.shape))} if values.ndim > 1 else {}
    return {"dtype": kind, "bdata": packed, **shape}


def make_subplots(
    widths: Sequence[float],
    heights: Sequence[float] = (1.0,),
    *,
    gaps: tuple[float, float] = (0.1, 0.0),
    tall: Sequence[tuple[int, int]] = (),
    titles: Sequence[str] = (),
) -> Figure:
    """Return a figure of several panels.

    Parameters
    ----------
    widths, heights : sequence of float
        Relative sizes of columns and rows, from the left and from the top.
    gaps : tuple of float
        Space between columns and between rows, as shares of the figure.
    tall : sequence of (row, column)
        Cells that reach down to the last row.
    titles : sequence of str
        Texts above the cells, row by row.
    """
    across, down = _divide(widths, gaps[0]), _divide(heights, gaps[1])
    columns = dict(tall_cell[::-1] for tall_cell in tall)
    cells = [
        (row, column)
        for row in range(1, len(down) + 1)
        for column in range(1, len(across) + 1)
        if row <= columns.get(column, row)
    ]
    suffixes = {cell: str(k) if k > 1 else "" for k, cell in enumerate(cells, start=1)}
    layout: dict[str, Any] = {"annotations": []}
    for k, ((row, column), suffix) in enumerate(suffixes.items()):
        last = len(down) if (row, column) in tall else row
        rows = [1.0 - down[last - 1][1], 1.0 - down[row - 1][0]]
        layout[f"xaxis{suffix}"] = {"anchor": f"y{suffix}", "domain": list(across[column - 1])}
        layout[f"yaxis{suffix}"] = {"anchor": f"x{suffix}", "domain": rows}
        if k < len(titles):
            layout["annotations"].append(_make_title(titles[k], across[column - 1], rows[1]))
    figure = Figure()
    figure.split(suffixes, layout)
    return figure


def _divide(sizes: Sequence[float], gap: float) -> list[tuple[float, float]]:
    """Divide the length 1 into parts of relative `sizes` with a `gap` between them."""
    room = (1.0 - gap * (len(sizes) - 1)) / sum(sizes)
    ends = [sum(sizes[: k + 1]) * room + gap * k for k in range(len(sizes))]
    return [(float(end - size * room), float(end)) for size, end in zip(sizes, ends, strict=True)]


def _make_title(text: str, across: tuple[float, float], top: float) -> dict[str, Any]:
    return {
        "text": text,
        "font": {"size": 16},
        "showarrow": False,
        "x": 0.5 * sum(across),
        "xanchor": "center",
        "xref": "paper",
        "y": top,
        "yanchor": "bottom",
        "yref": "paper",
    }
