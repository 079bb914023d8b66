# SPDX-License-Identifier: MIT
"""Choice of the log that a view shows, where several are open."""

from __future__ import annotations

from enum import StrEnum

from dash import Input
from dash.development.base_component import Component

from drivetwin.workbench.session import Session
from drivetwin.workbench.session_state import SessionState
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.fields import Index


class Place(StrEnum):
    """Views with the choice."""

    CHANNELS = "channels"
    SHIFTS = "shifts"
    MODEL = "model"


def build_log_choice(work: SessionState, place: Place) -> list[Component]:
    """Build the choice; nothing for a single log."""
    if len(work.logs) < 2:
        return []
    names = {str(k): one.source.name for k, one in enumerate(work.logs)}
    return [ui.make_choice(f"{place}-log", "Log shown", names, str(work.at))]


def register(page: ui.Page, place: Place) -> None:
    """Register the choice of one view; all views then show the chosen log."""

    @page.callback(Input(f"{place}-log", "data-value"))
    def choose(session: Session, index: Index | None) -> None:
        """Show another log."""
        if index is not None and int(index) != session.work.at:
            session.select_log(int(index))
            ui.notify_topic(ui.Topic.SELECTION)
