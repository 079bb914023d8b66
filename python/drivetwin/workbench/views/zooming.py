# SPDX-License-Identifier: MIT
"""Zoom of the figures over time: all samples in view, and the shift in view selected."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from dash import Input, Output, Patch, no_update

from drivetwin.report.figures.stack import Panel, compute_y_ranges
from drivetwin.workbench.session import Session
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.zoom import collect_curves, parse_view


def register(page: ui.Page, plot: str, get_panels: Callable[[Session], Sequence[Panel]]) -> None:
    """Draw the figure `plot` anew where it is zoomed; `get_panels` returns its panels."""

    @page.callback(Output(plot, "figure", allow_duplicate=True), Input(plot, "relayoutData"))
    def follow(session: Session, change: dict[str, Any] | None) -> Any:
        """Send the samples in view."""
        view = parse_view(change or {})
        if view is None:
            return no_update
        if session.set_view(view):
            ui.notify_topic(ui.Topic.PHASES)
        panels = get_panels(session)
        patch = Patch()
        for place, curve in collect_curves(panels, view).items():
            patch["data"][place]["x"] = curve["x"]
            patch["data"][place]["y"] = curve["y"]
        patch["layout"]["xaxis"]["range"] = list(view)
        for axis, ends in compute_y_ranges(panels, view).items():
            patch["layout"][axis]["range"] = list(ends)
        return patch
