# SPDX-License-Identifier: MIT
"""Navigation by steps: the state of each step beside its name and at the head of its view."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from dash import Dash, Input, Output, State, html
from dash.development.base_component import Component

from drivetwin.channels.roles import NEEDED
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.report.blocks import Tone
from drivetwin.report.model_verdict import STATUS_TONES
from drivetwin.workbench.session import Sessions
from drivetwin.workbench.session_state import SessionState
from drivetwin.workbench.views.widgets import Topic, make_attributes, make_topic_id


class Step(StrEnum):
    """Step of the workbench, in order; the values are those of the views."""

    LOG = "log"
    CHANNELS = "channels"
    CARD = "card"
    SHIFTS = "shifts"
    IDENTIFY = "identify"
    MODEL = "model"
    EXPORT = "export"


class Status(StrEnum):
    """Status of a step."""

    DONE = "done"
    NEXT = "next"
    OPEN = "open"
    RUNNING = "running"
    BLOCKED = "blocked"


@dataclass(frozen=True)
class StepState:
    """Status of a step, what was done or what is missing, and the step that resolves a block."""

    step: Step
    status: Status
    text: str
    remedy: Step | None = None
    has_content: bool = False
    """True where the view of a blocked step shows the reasons."""
    tone: Tone | None = None
    """Colour of the verdict on the model, for a step that has one."""


def assess_steps(work: SessionState, *, running: bool = False) -> list[StepState]:
    """Return the state of each step in order; the first one that can be done is the next."""
    found: list[StepState] = []
    for one in _iterate_states(work, running):
        is_next = one.status is Status.OPEN and not any(
            other.status in (Status.NEXT, Status.RUNNING) for other in found
        )
        found.append(StepState(one.step, Status.NEXT, one.text) if is_next else one)
    return found


def _iterate_states(work: SessionState, running: bool) -> Iterator[StepState]:
    """Yield the state of each step; a step that can be done is open."""
    if work.opened is None:
        yield StepState(Step.LOG, Status.OPEN, "Open a log, or the sample.")
        for step in list(Step)[1:]:
            yield StepState(step, Status.BLOCKED, "No log is open.", Step.LOG)
        return
    names = ", ".join(one.source.name for one in work.logs)
    yield StepState(Step.LOG, Status.DONE, f"Open: {names}.")
    channels = _assess_channels(work)
    shifts = _assess_shifts(work, channels)
    identified = _assess_identification(work, shifts)
    if running:
        text = "The identification is running."
        identified = StepState(Step.IDENTIFY, Status.RUNNING, text)
    yield from (channels, _assess_card(work), shifts, identified)
    yield from _assess_use(work, identified)


def _assess_channels(work: SessionState) -> StepState:
    for one in work.logs:
        if one.opened.log is None:
            text = f"{one.source.name} cannot be read as mapped."
            return StepState(Step.CHANNELS, Status.OPEN, text)
    log = work.require_log()
    missing = [role for role in NEEDED if role not in log]
    tail = f"; not in the log: {', '.join(missing)}." if missing else "."
    text = f"{len(log.channels)} channels are mapped{tail}"
    return StepState(Step.CHANNELS, Status.DONE, text)


def _assess_card(work: SessionState) -> StepState:
    opened = work.require_opened()
    if opened.card is None and opened.ratios is None:
        text = "Open a vehicle card, or write one; for bus logs a card of the ratios is enough."
        return StepState(Step.CARD, Status.OPEN, text)
    name = "The card" if work.card is None else work.card.name
    doubt = f", with {len(opened.doubts)} doubtful entries" if opened.doubts else ""
    return StepState(Step.CARD, Status.DONE, f"{name} is open{doubt}.")


def _assess_shifts(work: SessionState, channels: StepState) -> StepState:
    """Count the shifts and what is held out of them; of bus logs once they are identified."""
    opened, count = work.require_opened(), len(work.all_shifts)
    if channels.status is Status.OPEN:
        return StepState(Step.SHIFTS, Status.BLOCKED, channels.text, Step.CHANNELS)
    if opened.card is None and opened.ratios is None:
        return StepState(Step.SHIFTS, Status.BLOCKED, "No vehicle card is open.", Step.CARD)
    if not count and opened.ratios is None:
        text = "The log has no usable shift. The reasons are below."
        return StepState(Step.SHIFTS, Status.BLOCKED, text, Step.CARD, has_content=True)
    text = f"{_count(count, 'shift')} of {_count(len(work.logs), 'log')} found"
    if opened.ratios is not None:
        text = "The identification finds the shifts of the bus logs"
    if work.bus is not None:
        text = f"{_count(len(work.bus.found.shifts), 'shift')} found"
    held = sum(len(one.held) for one in work.logs)
    return StepState(Step.SHIFTS, Status.DONE, f"{text}{f', {held} held out' if held else ''}.")


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def _assess_identification(work: SessionState, shifts: StepState) -> StepState:
    """Return the state of the identification, with the verdict on the model once finished."""
    if shifts.status is Status.BLOCKED:
        return StepState(Step.IDENTIFY, Status.BLOCKED, shifts.text, shifts.remedy)
    if all(len(one.held) == one.parts for one in work.logs):
        text = "All shifts are held out."
        return StepState(Step.IDENTIFY, Status.BLOCKED, text, Step.SHIFTS)
    if work.bus is None and work.result is None:
        text = "The identification failed." if work.ended else "Press Identify."
        return StepState(Step.IDENTIFY, Status.OPEN, text)
    tone: Tone | None = None
    estimates: Mapping[str, Estimate]
    if work.bus is not None:
        estimates, text = work.bus.found.estimates, "Bus logs"
    elif (outcome := work.require_outcome()).found is None:
        estimates, tone = outcome.twin.parameters, Tone.UNKNOWN
        text = "Twin of a workspace, without the evidence for a verdict"
    else:
        estimates, status = outcome.twin.parameters, outcome.found.status
        text, tone = f"Model {status.value}", STATUS_TONES[status]
    identified = sum(one.verdict is Verdict.IDENTIFIED for one in estimates.values())
    text += f": {identified} of {len(estimates)} values identified."
    return StepState(Step.IDENTIFY, Status.DONE, text, tone=tone)


def _assess_use(work: SessionState, identified: StepState) -> Iterator[StepState]:
    """Yield the states of model and export, which need a finished identification."""
    if identified.status is not Status.DONE:
        is_running = identified.status is Status.RUNNING
        text = identified.text if is_running else "Nothing is identified."
        for step in (Step.MODEL, Step.EXPORT):
            yield StepState(step, Status.BLOCKED, text, Step.IDENTIFY)
        return
    status, text = Status.OPEN, "Compare simulation and measurement."
    if work.bus is not None:
        status, text = Status.BLOCKED, "Bus logs give quantities, but no model."
    elif work.has_viewed:
        status, text = Status.DONE, "Simulation and measurement were compared."
        if work.require_open_log().source.name not in work.require_outcome().twins:
            text = "The log shown was not fitted; choose a fitted one."
    yield StepState(Step.MODEL, status, text)
    status, text = Status.OPEN, "Download report, result or model."
    if work.has_exported:
        status, text = Status.DONE, "A file was exported."
    yield StepState(Step.EXPORT, status, text)


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
