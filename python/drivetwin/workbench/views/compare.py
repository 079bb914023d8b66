# SPDX-License-Identifier: MIT
"""Compare: what the paper's, the integral and the likelihood method found, side by side."""

from __future__ import annotations

from dataclasses import replace

from dash import Input, Output, html
from dash.development.base_component import Component

from drivetwin.report.comparison import trials_of
from drivetwin.report.find_reports import Candidate
from drivetwin.report.sections.comparison import (
    agreement_section,
    friction_overlay_section,
    trial_sections,
)
from drivetwin.workbench.session import Session
from drivetwin.workbench.session_state import Work
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.blocks import shown


def layout() -> list[Component]:
    """Filled when there are results."""
    return [
        ui.hint(
            "Parameters with intervals, simulation over measurement and friction of every method "
            "that has answered. Identify with all three methods to fill this view."
        ),
        ui.button("Simulate and draw all methods", "draw-comparison"),
        html.Div(id="compare-content"),
    ]


def register(page: ui.Page) -> None:
    """Drawing on demand: the figures of three methods take seconds."""

    @page.callback(Output("compare-content", "children"), Input(ui.due_id("compare"), "data"))
    def tables(session: Session, _: int) -> list[Component]:
        """The parameters side by side, as soon as there are two results."""
        work = session.work
        refusals = [
            ui.notes(f"The {method.value} method found nothing", [text])
            for method, text in work.refusals.items()
        ]
        candidates = _candidates(work)
        if len(candidates) < 2:
            return [*refusals, ui.hint("There are no two results to compare yet.")]
        return [*refusals, *shown(agreement_section(candidates), "agree")]

    @page.callback(
        Output("compare-content", "children", allow_duplicate=True),
        Input("draw-comparison", "n_clicks"),
        busy="draw-comparison",
    )
    def draw(session: Session, _: int) -> list[Component]:
        """All of it: agreement, every shift by every method, friction."""
        work = session.work
        candidates = _candidates(work)
        log = work.require_log()
        work.require_outcome()
        twins = {method.value: one.twin for method, one in work.results.items()}
        trials = trials_of(twins, log, work.shifts, log.source)
        sections = [
            *([agreement_section(candidates)] if len(candidates) > 1 else []),
            *trial_sections(candidates, trials),
            friction_overlay_section(candidates),
        ]
        return [
            part
            for number, section in enumerate(sections)
            if section.blocks
            for part in shown(section, f"compare-{number}")
        ]


def _candidates(work: Work) -> list[Candidate]:
    return [
        replace(
            Candidate.of_twin(method.value, one.twin),
            fit=one.found.fit if one.found is not None else {},
        )
        for method, one in work.results.items()
    ]
