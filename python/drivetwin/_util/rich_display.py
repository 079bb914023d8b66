# SPDX-License-Identifier: MIT
"""What results offer in a notebook: `plot()`, `summary()` and a rich representation.

The one place where a result asks the report, which stands above it, to draw it; the import waits
until somebody asks.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import plotly.graph_objects as go

    from drivetwin.report.notebook import Summary


class Shown:
    """Base of what can be looked at: a log, its shifts, an identification, a twin, a validation."""

    def plot(self) -> go.Figure:
        """Figure of it, the same as in the report."""
        from drivetwin.report.notebook import figure_of

        return figure_of(self)

    def summary(self) -> Summary:
        """What it says in a few lines: text for `print`, a table in a notebook."""
        from drivetwin.report.notebook import summary_of

        return summary_of(self)

    def _repr_html_(self) -> str:
        """Representation in a notebook."""
        return self.summary().html
