# SPDX-License-Identifier: MIT
"""Mixin of results: `plot()`, `summary()` and a rich representation in notebooks.

The report draws the result. It is a higher layer, so it is imported only on use.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import plotly.graph_objects as go

    from drivetwin.report.notebook import Summary


class Shown:
    """Base of what can be looked at: a log, its shifts, an identification, a twin, a validation."""

    def plot(self) -> go.Figure:
        """Plot the result as in the report."""
        from drivetwin.report.notebook import figure_of

        return figure_of(self)

    def summary(self) -> Summary:
        """Summarise the result in a few lines: text for `print`, a table in a notebook."""
        from drivetwin.report.notebook import summary_of

        return summary_of(self)

    def _repr_html_(self) -> str:
        """Representation in a notebook."""
        return self.summary().html
