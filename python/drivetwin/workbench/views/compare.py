# SPDX-License-Identifier: MIT
"""Compare: results of the paper's and the likelihood method side by side."""

from __future__ import annotations

from dataclasses import replace

from dash import Input, Output, html
from dash.development.base_component import Component

from drivetwin.report.comparison import (
    build_agreement_section,
    build_friction_overlay_section,
    build_trial_sections,
    simulate_trials,
)
from drivetwin.report.find_reports import Candidate
from drivetwin.workbench.page_words import replace_options
from drivetwin.workbench.session import Session
from drivetwin.workbench.session_state import SessionState
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.widgets import render_section


def layout() -> list[Component]:
    """Filled when there are results."""
    return [
        ui.make_hint(
            "Parameters with intervals, simulation over measurement and friction of each method. "
            "Run both methods in the step Identify first."
        ),
        ui.make_button("Simulate and draw both methods", "draw-comparison"),
        html.Div(id="compare-content"),
    ]


def register(page: ui.Page) -> None:
    """Drawing on demand: the figures of two methods take seconds."""

    @page.callback(Output("compare-content", "children"), Input(ui.make_due_id("compare"), "data"))
    def tables(session: Session, _: object) -> list[Component]:
        """The parameters side by side, as soon as there are two results."""
        work = session.work
        refusals = [
            ui.make_notes(f"Identification failed: {method.value} method", [replace_options(text)])
            for method, text in work.refusals.items()
        ]
        candidates = _collect_candidates(work)
        if len(candidates) < 2:
            return [*refusals, ui.make_hint("Run both methods first.")]
        return [*refusals, *render_section(build_agreement_section(candidates), "agree")]

    @page.callback(
        Output("compare-content", "children", allow_duplicate=True),
        Input("draw-comparison", "n_clicks"),
        busy="draw-comparison",
    )
    def draw(session: Session, _: object) -> list[Component]:
        """All of it: agreement, every shift by every method, friction."""
        work = session.work
        candidates = _collect_candidates(work)
        log = work.require_log()
        work.require_twin()
        twins = {
            method.value: one.twins[log.source]
            for method, one in work.results.items()
            if log.source in one.twins
        }
        trials = simulate_trials(twins, log, work.shifts, log.source)
        sections = [
            *([build_agreement_section(candidates)] if len(candidates) > 1 else []),
            *build_trial_sections(candidates, trials),
            build_friction_overlay_section(candidates),
        ]
        return [
            part
            for number, section in enumerate(sections)
            if section.blocks
            for part in render_section(section, f"compare-{number}")
        ]


def _collect_candidates(work: SessionState) -> list[Candidate]:
    return [
        replace(
            Candidate.from_twin(method.value, one.twin),
            fit=one.found.fit if one.found is not None else {},
        )
        for method, one in work.results.items()
    ]
