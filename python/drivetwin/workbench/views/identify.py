# SPDX-License-Identifier: MIT
"""Identify: the run in the background, how far it is, and what came of it."""

from __future__ import annotations

from collections import Counter

from dash import Dash, Input, Output, State, dcc, html, no_update
from dash.development.base_component import Component

from drivetwin.estimation.result.estimate import Verdict
from drivetwin.estimation.result.method import Method
from drivetwin.report.labels import parameter_label
from drivetwin.report.sections.parameters import trust_section
from drivetwin.workbench.locks import LockKind
from drivetwin.workbench.session import Sessions
from drivetwin.workbench.session_state import Work
from drivetwin.workbench.views.blocks import shown
from drivetwin.workbench.views.log import facts_line
from drivetwin.workbench.views.widgets import (
    Topic,
    acted,
    announce,
    button,
    choice,
    due_id,
    hint,
    notes,
    row,
    table,
    tell,
    told,
    topic_id,
)

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
        hint(
            "Runs in a process of its own; the page stays free. The integral and the likelihood "
            "method take phases and locks as set; the paper's procedure knows no locks."
        ),
        row(
            choice("methods", "Methods", _UP_TO, "likelihood"),
            button("Identify", "identify", main=True),
            button("Cancel", "cancel", disabled=True),
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


def register(app: Dash, sessions: Sessions) -> None:
    """Starting, following and stopping the job."""
    _register_buttons(app, sessions)
    _register_progress(app, sessions)


def _register_buttons(app: Dash, sessions: Sessions) -> None:
    @app.callback(
        Input("identify", "n_clicks"),
        State("session", "data"),
        State("methods", "data-value"),
        prevent_initial_call=True,
    )
    @acted
    def start(_: int, key: str, up_to: str) -> None:
        """Begin the identification."""
        order = list(Method)
        sessions.get(key).identify(order[: order.index(Method(up_to)) + 1])
        tell("")
        announce(Topic.RESULTS)

    @app.callback(Input("cancel", "n_clicks"), State("session", "data"), prevent_initial_call=True)
    @acted
    def cancel(_: int, key: str) -> None:
        """Stop it."""
        sessions.get(key).cancel()
        tell("The identification was cancelled")
        announce(Topic.RESULTS)


def _register_progress(app: Dash, sessions: Sessions) -> None:
    @app.callback(
        Output("progress", "value"),
        Output("progress-text", "children"),
        Input("tick", "n_intervals"),
        State("session", "data"),
        prevent_initial_call=True,
    )
    @told
    def follow(_: int, key: str) -> tuple[object, object]:
        """Take in results as they come."""
        session = sessions.get(key)
        try:
            if session.poll():
                announce(Topic.RESULTS)
        except Exception:
            announce(Topic.RESULTS)
            raise
        job = session.job
        if job is None:
            return no_update, no_update
        return f"{job.share:.3f}", f"{job.text or 'starting'} · {job.elapsed:.0f} s"

    @app.callback(
        Output("tick", "disabled"),
        Output("progress-box", "hidden"),
        Output("identify", "disabled"),
        Output("cancel", "disabled"),
        Input(topic_id(Topic.RESULTS), "data"),
        State("session", "data"),
        prevent_initial_call=True,
    )
    @told
    def follow_on(_: int, key: str) -> tuple[bool, bool, bool, bool]:
        """Look at the job for as long as there is one."""
        busy = sessions.get(key).job is not None
        return not busy, not busy, busy, not busy

    @app.callback(
        Output("identify-content", "children"),
        Input(due_id("identify"), "data"),
        State("session", "data"),
        prevent_initial_call=True,
    )
    @told
    def show(_: str, key: str) -> list[Component]:
        """Render the present results."""
        return _content(sessions.get(key).work)


def _content(work: Work) -> list[Component]:
    content: list[Component] = [_before(work)]
    for text in dict.fromkeys(work.refusals.values()):
        methods = [method.value for method, why in work.refusals.items() if why == text]
        content.append(notes(f"Nothing found by: {', '.join(methods)} method", [text]))
    if work.ended:
        content.append(notes("The identification ended early", [work.ended]))
    if work.method is None:
        return content
    outcome = work.results[work.method]
    if outcome.found is None:
        count = Counter(one.verdict for one in outcome.twin.parameters.values())
        told = {verdict.value: str(count[verdict]) for verdict in Verdict if count[verdict]}
        content.append(facts_line({"method": outcome.twin.method.value, **told}))
        content.append(hint("From the saved workspace; identify again for evidence and report."))
    else:
        content += shown(trust_section(outcome.found), "trust")
    content.append(notes("Assumptions", outcome.twin.assumptions, "plain"))
    return content


def _before(work: Work) -> Component:
    """Describe the inputs of the next run."""
    rows = []
    for index, times in work.moves.items():
        shift = work.shifts[index]
        rows.append((f"phases {shift.start_gear}→{shift.end_gear}", f"{len(times)} set by hand"))
    for name, lock in work.locks.items():
        text = "free" if lock.kind is LockKind.FREE else f"{lock.value:.5g} (SI)"
        if lock.kind is LockKind.PRIOR:
            text += f" ± {lock.std:.2g}"
        rows.append((parameter_label(name), f"{lock.kind.value}: {text}"))
    if not rows:
        return html.Div()
    return table(("set by hand", ""), rows, "Beside the vehicle card, the next run takes")
