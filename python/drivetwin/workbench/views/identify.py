# SPDX-License-Identifier: MIT
"""Identify: the run in the background, how far it is, and what came of it."""

from __future__ import annotations

from collections import Counter

from dash import Input, Output, State, dcc, html, no_update
from dash.development.base_component import Component

from drivetwin.estimation.result.estimate import Verdict
from drivetwin.estimation.result.method import Method
from drivetwin.report.labels import get_parameter_label
from drivetwin.report.sections.fits import build_fit_table
from drivetwin.report.sections.parameters import build_findings_section, build_result_section
from drivetwin.vehicle.locks import LockKind
from drivetwin.workbench.session import Session
from drivetwin.workbench.session_state import SessionState
from drivetwin.workbench.views import widgets as ui
from drivetwin.workbench.views.blocks import render_block, render_section
from drivetwin.workbench.views.log import build_facts_line

_UP_TO = {
    "likelihood": "paper, integral and likelihood",
    "integral": "paper and integral (quick)",
    "paper": "paper alone",
}
_POLL = 300
"""Time [ms] between two looks at the running job."""


def layout() -> list[Component]:
    """Run, cancel, progress, outcome."""
    return [
        ui.make_hint(
            "Runs in a process of its own; the page stays free. The integral and the likelihood "
            "method take phases and locks as set; the paper's procedure knows no locks."
        ),
        ui.make_row(
            ui.make_choice("methods", "Methods", _UP_TO, "likelihood"),
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
    @page.callback(Input("identify", "n_clicks"), State("methods", "data-value"))
    def start(session: Session, _: object, up_to: Method) -> None:
        """Begin the identification."""
        order = list(Method)
        session.identify(order[: order.index(up_to) + 1])
        ui.notify("")
        ui.notify_topic(ui.Topic.RESULTS)

    @page.callback(Input("cancel", "n_clicks"))
    def cancel(session: Session, _: object) -> None:
        """Stop it."""
        session.cancel()
        ui.notify("The identification was cancelled")
        ui.notify_topic(ui.Topic.RESULTS)


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
                ui.notify_topic(ui.Topic.RESULTS)
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
        return _build_content(session.work)


def _build_content(work: SessionState) -> list[Component]:
    content: list[Component] = [_describe_inputs(work)]
    for text in dict.fromkeys(work.refusals.values()):
        methods = [method.value for method, why in work.refusals.items() if why == text]
        content.append(ui.make_notes(f"Nothing found by: {', '.join(methods)} method", [text]))
    if work.ended:
        content.append(ui.make_notes("The identification ended early", [work.ended]))
    if work.method is None:
        return content
    outcome = work.results[work.method]
    if outcome.found is None:
        count = Counter(one.verdict for one in outcome.twin.parameters.values())
        told = {verdict.value: str(count[verdict]) for verdict in Verdict if count[verdict]}
        content.append(build_facts_line({"method": outcome.twin.method.value, **told}))
        content.append(
            ui.make_hint("From the saved workspace; identify again for evidence and report.")
        )
    else:
        content += render_section(build_result_section(outcome.found), "result")
        if outcome.found.findings:
            content += render_section(build_findings_section(outcome.found), "findings")
        if outcome.found.fit:
            content.append(render_block(build_fit_table(outcome.found.fit), "fit"))
    content.append(ui.make_notes("Assumptions", outcome.twin.assumptions, "plain"))
    return content


def _describe_inputs(work: SessionState) -> Component:
    """Describe the inputs of the next run."""
    rows = []
    for index, times in work.moves.items():
        shift = work.shifts[index]
        rows.append((f"phases {shift.start_gear}→{shift.end_gear}", f"{len(times)} set by hand"))
    for name, lock in work.locks.items():
        text = "free" if lock.kind is LockKind.FREE else f"{lock.value:.5g} (SI)"
        if lock.kind is LockKind.PRIOR:
            text += f" ± {lock.std:.2g}"
        rows.append((get_parameter_label(name), f"{lock.kind.value}: {text}"))
    if not rows:
        return html.Div()
    return ui.make_table(("set by hand", ""), rows, "Beside the vehicle card, the next run takes")
