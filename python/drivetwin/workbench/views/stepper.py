# SPDX-License-Identifier: MIT
"""Navigation by steps: the state of each step beside its name and at the head of its view."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dash import Dash, Input, Output, State, html
from dash.development.base_component import Component

from drivetwin.workbench.session_state import SessionState
from drivetwin.workbench.sessions import Sessions
from drivetwin.workbench.steps import Status, Step, StepState, assess_steps
from drivetwin.workbench.views.widgets import Topic, make_attributes, make_topic_id

TITLES = {
    Step.LOG: "Log",
    Step.CHANNELS: "Channels",
    Step.CARD: "Card",
    Step.SHIFTS: "Shifts",
    Step.IDENTIFY: "Identify",
    Step.MODEL: "Model",
    Step.EXPORT: "Report and export",
}


def build_navigation(more: Mapping[str, str]) -> Component:
    """Build the list of steps, and below it the views beside them, titles by id."""
    steps = [
        html.Li(_build_button(step.value, [f"{number} ", title], state=True))
        for number, (step, title) in enumerate(TITLES.items(), start=1)
    ]
    others = [html.Li(_build_button(name, [title], state=False)) for name, title in more.items()]
    return html.Nav(
        [
            html.H1(["drivetwin", html.Small("workbench")]),
            html.Ol(steps),
            html.Ul(others),
        ],
        className="side",
        **make_attributes(aria_label="Steps and views"),
    )


def build_panel(name: str, title: str, content: list[Component], *, hidden: bool) -> Component:
    """Build the view `name`; that of a step has its state below the title."""
    is_step = name in set(Step)
    head: list[Component] = [html.H2(title, tabIndex="-1")]
    if is_step:
        head.append(html.Div(id=f"step-{name}", className="step"))
    body = html.Div(content, id=f"body-{name}", hidden=is_step and name != Step.LOG)
    return html.Section(
        [*head, body],
        id=f"view-{name}",
        hidden=hidden,
        **make_attributes(aria_label=f"{title} view"),
    )


def register_states(app: Dash, sessions: Sessions) -> None:
    """Show the state of each step whenever the session changes."""

    @app.callback(
        *(Output(f"state-{step}", "children") for step in Step),
        *(Output(f"state-{step}", "className") for step in Step),
        *(Output(f"step-{step}", "children") for step in Step),
        *(Output(f"body-{step}", "hidden") for step in Step),
        Input(make_topic_id(Topic.STEPS), "data"),
        State("session", "data"),
    )
    def show(_: object, key: object) -> list[Any]:
        """Assess the steps of the session."""
        session = sessions.get(key) if key in sessions else None
        work = SessionState() if session is None else session.work
        found = assess_steps(work, running=session is not None and session.job is not None)
        following = [*found[1:], None]
        return [
            *(one.status.value for one in found),
            *(f"state {_get_colour(one)}" for one in found),
            *(_build_head(one, after) for one, after in zip(found, following, strict=True)),
            *(one.status is Status.BLOCKED and not one.has_content for one in found),
        ]


def _build_button(name: str, title: list[str], *, state: bool) -> Component:
    parts: list[Component] = [html.Span(title)]
    if state:
        parts.append(html.Small(id=f"state-{name}", className="state"))
    return html.Button(
        parts, id=f"nav-{name}", type="button", **make_attributes(aria_current="false")
    )


def _get_colour(one: StepState) -> str:
    """Return the colour class of a step: that of its verdict, else of its status."""
    return one.tone or one.status


def _build_head(one: StepState, after: StepState | None) -> list[Component]:
    """Build the state of a step: what was done or is missing, and the way on."""
    text = f"Blocked: {one.text}" if one.status is Status.BLOCKED else one.text
    parts: list[Component] = [html.P(text, className=f"head {_get_colour(one)}")]
    if one.remedy is not None:
        parts.append(build_go_button(f"Go to {TITLES[one.remedy]}", one.remedy))
    elif one.status is Status.DONE and after is not None and after.status is not Status.BLOCKED:
        parts.append(build_go_button(f"Continue with {TITLES[after.step]}", after.step))
    return parts


def build_go_button(text: str, step: Step) -> Component:
    """Build a button that opens the view of a step."""
    return html.Button(text, type="button", **make_attributes(data_go=step.value))
