# SPDX-License-Identifier: MIT
"""`plot()`, `summary()`, `to_frame()` and the notebook representation of results.

The report draws results and stands above them. The package registers the report's presenter here
when it is imported, so that results do not import the report.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol


class Presenter(Protocol):
    """Figures and summaries of results, by type of the result."""

    def draw_figure(self, shown: Any, /) -> Any:
        """Return the Plotly figure of a result."""

    def summarise(self, shown: Any, /) -> Any:
        """Return the summary of a result, as text and HTML."""

    def make_frame(self, shown: Any, /) -> Any:
        """Return the pandas data frame of a result."""


_loaders: list[Callable[[], Any]] = []


def register_presenter(load: Callable[[], Any]) -> None:
    """Register the function that imports the presenter; it is called at the first display."""
    _loaders[:] = [load]


def _load_presenter() -> Presenter:
    presenter: Presenter = _loaders[0]()
    return presenter


class DisplayMixin:
    """Base of displayable results: log, shifts, identification, twin, validation."""

    def plot(self) -> Any:
        """Return the Plotly figure of the report."""
        return _load_presenter().draw_figure(self)

    def summary(self) -> Any:
        """Return a summary in a few lines: text for `print`, a table in a notebook."""
        return _load_presenter().summarise(self)

    def to_frame(self) -> Any:
        """Return a pandas data frame: channels or signals over time, or parameters, in SI."""
        return _load_presenter().make_frame(self)

    def _repr_html_(self) -> str:
        """Return the HTML representation for notebooks."""
        return str(self.summary().html)
