# SPDX-License-Identifier: MIT
"""Identify: the run in the background, its progress and its result."""

from __future__ import annotations

from collections import Counter
from typing import Literal

from dash import Input, Output, State, dcc, html, no_update
from dash.development.base_component import Component

from drivetwin.estimation.result.estimate import Verdict
from drivetwin.report.blocks import build_findings_section, make_table
from drivetwin.report.figure import get_parameter_label
from drivetwin.report.parameters import build_result_section
from drivetwin.report.summary import build_fit_table, build_friction_section
from drivetwin.report.together import build_holdout_section, build_joint_section
from drivetwin.shifts.shift import make_shift_labels
from drivetwin.vehicle.locks import LockKind
from drivetwin.workbench.identifying import Outcome
from drivetwin.workbench.session import Session
from drivetwin.workbench.session_state import SessionState
from drivetwin.workbench.views import locks
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.log import build_facts_line
from drivetwin.workbench.views.widgets import (
    render_block,
    render_section,
    render_table,
    replace_options,
)

_EFFORTS = {"full": "full, with other models", "quick": "quick: one model alone"}
_POLL = 300
"""Time [ms] between two looks at the running job."""


def layout() -> list[Component]:
    """Run, cancel, progress, outcome."""
    return [
        ui.make_hint(
            "Runs in the background. Quick fits one model and tries no other minima and elements."
        ),
        ui.make_row(
            ui.make_choice("effort", "Effort", _EFFORTS, "full"),
            ui.make_button("Identify", "identify", main=True),
            ui.make_button("Cancel", "cancel", disabled=True),
        ),
        html.Div(
            [
                html.Label(
                    [
                        html.Span("Progress", className="label"),
                        html.Progress(id="progress", value="0", max="1"),
                    ],
                    className="field",
                ),
                html.P(id="progress-text", className="hint"),
            ],
            id="progress-box",
            hidden=True,
        ),
        dcc.Interval(id="tick", interval=_POLL, disabled=True),
        html.Div(id="identify-content"),
    ]


def register(page: ui.Page) -> None:
    """Starting, following and stopping the job."""
    _register_buttons(page)
    _register_progress(page)


def _register_buttons(page: ui.Page) -> None:
    @page.callback(Input("identify", "n_clicks"), State("effort", "data-value"))
    def start(session: Session, _: object, effort: Literal["full", "quick"]) -> None:
        """Begin the identification."""
        session.identify(is_quick=effort == "quick")
        ui.notify("")
        _notify_results(session)

    @page.callback(Input("cancel", "n_clicks"))
    def cancel(session: Session, _: object) -> None:
        """Stop it."""
        session.cancel()
        ui.notify("The identification was cancelled")
        ui.notify_topic(ui.Topic.RESULTS)


def _notify_results(session: Session) -> None:
    """Redraw the results, and the shifts of bus logs, which are part of them."""
    ui.notify_topic(ui.Topic.RESULTS)
    if session.work.ratios is not None:
        ui.notify_topic(ui.Topic.PHASES)


def _register_progress(page: ui.Page) -> None:
    @page.callback(
        Output("progress", "value"),
        Output("progress-text", "children"),
        Input("tick", "n_intervals"),
    )
    def follow(session: Session, _: object) -> tuple[object, object]:
        """Take in results as they come."""
        try:
            if session.collect_job_results():
                _notify_results(session)
        except Exception:
            ui.notify_topic(ui.Topic.RESULTS)
            raise
        job = session.job
        if job is None:
            return no_update, no_update
        return f"{job.share:.3f}", f"{job.text or 'starting'} · {job.elapsed:.0f} s"

    @page.callback(
        Output("tick", "disabled"),
        Output("progress-box", "hidden"),
        Output("identify", "disabled"),
        Output("cancel", "disabled"),
        Input(ui.make_topic_id(ui.Topic.RESULTS), "data"),
    )
    def follow_on(session: Session, _: object) -> tuple[bool, bool, bool, bool]:
        """Look at the job for as long as there is one."""
        busy = session.job is not None
        return not busy, not busy, busy, not busy

    @page.callback(
        Output("identify-content", "children"), Input(ui.make_due_id("identify"), "data")
    )
    def show(session: Session, _: object) -> list[Component]:
        """Render the present results."""
        return _build_content(session.work, running=session.job is not None)


def _build_content(work: SessionState, *, running: bool) -> list[Component]:
    """Build the result once a run is finished, and what a run takes."""
    if work.ratios is not None:
        return _build_bus_content(work, running=running)
    if not work.all_shifts:
        return []
    content = _build_end(work)
    if not running and work.result is not None:
        content += _build_result(work.result)
    content.append(_describe_inputs(work))
    if not running and work.result is None:
        content.append(_build_known(work))
    return content


def _build_end(work: SessionState) -> list[Component]:
    """Build the reason of an identification that failed."""
    ended = [replace_options(work.ended)] if work.ended else []
    return [ui.make_notes("The identification failed", ended)] if ended else []


def _build_bus_content(work: SessionState, *, running: bool) -> list[Component]:
    """Build the result of bus logs with the sections of their report."""
    content = _build_end(work)
    if work.bus is None:
        hint = "Bus logs with a card of the ratios: all shifts of all logs together, one method."
        return [*content, ui.make_hint(hint)]
    if running:
        return content
    sections = work.bus.build_sections()
    return content + [part for one in sections for part in render_section(one, f"bus-{one.anchor}")]


def _build_known(work: SessionState) -> Component:
    """Build the locks before an identification; after it they are beside the sliders."""
    summary = html.Summary("Known values of parameters (locks)")
    table = locks.build_table(work, locks.list_default_ids(work))
    return html.Details([summary, ui.make_hint(locks.HINT), table])


def _build_result(outcome: Outcome) -> list[Component]:
    content: list[Component] = []
    if outcome.found is None:
        count = Counter(one.verdict for one in outcome.twin.parameters.values())
        counts = {verdict.value: str(count[verdict]) for verdict in Verdict if count[verdict]}
        content.append(build_facts_line(counts))
        content.append(
            ui.make_hint("From the saved workspace; identify again for evidence and report.")
        )
    else:
        content += render_section(build_result_section(outcome.found), "result")
        held, several = outcome.found.evidence.held_out, outcome.found.evidence.several
        if held:
            content += render_section(build_holdout_section(outcome.found, held), "held-out")
        if several is not None:
            content += render_section(build_joint_section(outcome.found, several), "logs")
        if outcome.found.findings:
            content += render_section(build_findings_section(outcome.found.findings), "findings")
        if outcome.found.fit:
            content.append(render_block(build_fit_table(outcome.found.fit), "fit"))
        if outcome.found.friction:
            content += render_section(build_friction_section(outcome.found), "friction")
    content.append(ui.make_notes("Assumptions", outcome.twin.assumptions, "plain"))
    return content


def _describe_inputs(work: SessionState) -> Component:
    """Describe the inputs of the next run."""
    rows = []
    for log in work.logs:
        where = f" of {log.source.name}" if len(work.logs) > 1 else ""
        labels = make_shift_labels(log.shifts)
        for index, times in log.moves.items():
            rows.append((f"phases {labels[index]}{where}", f"{len(times)} set by hand"))
        rows += [(f"shift {labels[k]}{where}", "held out") for k in sorted(log.held)]
    for name, lock in work.locks.items():
        text = "free" if lock.kind is LockKind.FREE else f"{lock.value:.5g} (SI)"
        if lock.kind is LockKind.PRIOR:
            text += f" ± {lock.std:.2g}"
        rows.append((get_parameter_label(name), f"{lock.kind.value}: {text}"))
    if not rows:
        return html.Div()
    caption = "The next run uses these settings besides the vehicle card"
    return render_table(make_table(caption, ("set by hand", ""), rows))
