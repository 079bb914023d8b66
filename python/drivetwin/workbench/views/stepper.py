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
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.report.blocks import Tone
from drivetwin.report.model_verdict import STATUS_TONES
from drivetwin.shifts.shift import make_shift_labels
from drivetwin.workbench.identifying import Outcome
from drivetwin.workbench.session_state import SessionState
from drivetwin.workbench.sessions import Sessions
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
    if work.opened is None or work.log is None:
        yield StepState(Step.LOG, Status.OPEN, "Open a log, or the sample.")
        for step in list(Step)[1:]:
            yield StepState(step, Status.BLOCKED, "No log is open.", Step.LOG)
        return
    yield StepState(Step.LOG, Status.DONE, _describe_logs(work))
    yield _assess_channels(work)
    yield _assess_card(work)
    yield _assess_shifts(work)
    yield _assess_identification(work, running)
    yield from _assess_use(work, running)


def _describe_logs(work: SessionState) -> str:
    names = [one.source.name for one in work.logs]
    return f"{names[0]} is open." if len(names) == 1 else f"{len(names)} logs are open."


def _find_unreadable(work: SessionState) -> str:
    """Return the fault of the first log that cannot be read as mapped; empty without one."""
    names = [one.source.name for one in work.logs if one.opened.log is None]
    return f"{names[0]} cannot be read as mapped." if names else ""


def _assess_channels(work: SessionState) -> StepState:
    log = work.require_opened().log
    fault = _find_unreadable(work)
    if log is None or fault:
        return StepState(Step.CHANNELS, Status.OPEN, fault)
    missing = [role for role in NEEDED if role not in log]
    if missing:
        text = f"{len(log.channels)} channels are mapped; not in the log: {', '.join(missing)}."
        return StepState(Step.CHANNELS, Status.DONE, text)
    return StepState(Step.CHANNELS, Status.DONE, f"{len(log.channels)} channels are mapped.")


def _assess_card(work: SessionState) -> StepState:
    opened = work.require_opened()
    if opened.ratios is not None:
        name = opened.ratios.name or opened.ratios.source
        text = f"{name} is open: ratios of {len(opened.ratios.ratios)} gears."
        return StepState(Step.CARD, Status.DONE, text)
    if opened.card is None:
        text = "Open a vehicle card, or write one; for bus logs a card of the ratios is enough."
        return StepState(Step.CARD, Status.OPEN, text)
    name = work.card.name if work.card is not None else opened.card.name
    count = len(opened.doubts)
    doubt = f"; {count} {'remark' if count == 1 else 'remarks'}" if count else ""
    return StepState(Step.CARD, Status.DONE, f"{name} is open{doubt}.")


def _assess_shifts(work: SessionState) -> StepState:
    opened = work.require_opened()
    if fault := _find_unreadable(work):
        return StepState(Step.SHIFTS, Status.BLOCKED, fault, Step.CHANNELS)
    if opened.ratios is not None:
        return StepState(Step.SHIFTS, Status.DONE, _describe_bus_shifts(work))
    if opened.card is None:
        return StepState(Step.SHIFTS, Status.BLOCKED, "No vehicle card is open.", Step.CARD)
    if not work.all_shifts:
        text = "The log has no usable shift. The reasons are below."
        return StepState(Step.SHIFTS, Status.BLOCKED, text, Step.CARD, has_content=True)
    return StepState(Step.SHIFTS, Status.DONE, _describe_shifts(work))


def _describe_bus_shifts(work: SessionState) -> str:
    held = sum(bool(one.held) for one in work.logs)
    tail = f", {held} {'log' if held == 1 else 'logs'} held out." if held else "."
    if work.bus is None:
        return f"The identification finds the shifts of the bus logs{tail}"
    count = len(work.bus.found.shifts)
    return f"{count} {'shift' if count == 1 else 'shifts'} found{tail}"


def _describe_shifts(work: SessionState) -> str:
    """Name the shifts of one log, or count those of several; and those held out."""
    count = len(work.all_shifts)
    held = sum(len(one.held) for one in work.logs)
    if len(work.logs) == 1:
        text = f"{', '.join(make_shift_labels(work.shifts))} found"
    else:
        text = f"{count} {'shift' if count == 1 else 'shifts'} of {len(work.logs)} logs found"
    return f"{text}, {held} held out." if held else f"{text}."


def _assess_identification(work: SessionState, running: bool) -> StepState:
    if running:
        return StepState(Step.IDENTIFY, Status.RUNNING, "The identification is running.")
    if fault := _find_unreadable(work):
        return StepState(Step.IDENTIFY, Status.BLOCKED, fault, Step.CHANNELS)
    if work.ratios is not None:
        return _assess_bus(work)
    if not work.all_shifts:
        return StepState(Step.IDENTIFY, Status.BLOCKED, "There is no shift.", Step.SHIFTS)
    if not any(one.fitted for one in work.logs):
        text = "Every shift is held out."
        return StepState(Step.IDENTIFY, Status.BLOCKED, text, Step.SHIFTS)
    if work.result is not None:
        return _assess_outcome(work.result)
    text = "The identification failed." if work.ended else "Press Identify."
    return StepState(Step.IDENTIFY, Status.OPEN, text)


def _assess_bus(work: SessionState) -> StepState:
    """Return the state of the identification of bus logs."""
    if work.bus is not None:
        verdicts = [one.verdict for one in work.bus.found.estimates.values()]
        count = verdicts.count(Verdict.IDENTIFIED)
        text = f"{count} of {len(verdicts)} quantities identified."
        return StepState(Step.IDENTIFY, Status.DONE, text)
    if all(one.held for one in work.logs):
        return StepState(Step.IDENTIFY, Status.BLOCKED, "Every log is held out.", Step.SHIFTS)
    text = "The identification failed." if work.ended else "Press Identify."
    return StepState(Step.IDENTIFY, Status.OPEN, text)


def _assess_outcome(outcome: Outcome) -> StepState:
    """Return the state of a finished identification, with the verdict on the model."""
    verdicts = [one.verdict for one in outcome.twin.parameters.values()]
    identified = verdicts.count(Verdict.IDENTIFIED)
    count = f"{identified} of {len(verdicts)} parameters identified"
    if outcome.found is None:
        text = f"Twin of a workspace, without the evidence for a verdict: {count}."
        return StepState(Step.IDENTIFY, Status.DONE, text, tone=Tone.UNKNOWN)
    status = outcome.found.status
    text = f"Model {status.value}: {count}."
    return StepState(Step.IDENTIFY, Status.DONE, text, tone=STATUS_TONES[status])


def _assess_use(work: SessionState, running: bool) -> Iterator[StepState]:
    """Yield the states of model and export, which need a finished identification."""
    if not running and work.bus is not None:
        yield StepState(Step.MODEL, Status.BLOCKED, "Bus logs give quantities, but no model.")
        yield _assess_export(work)
        return
    if running or work.result is None:
        text = "The identification is running." if running else "Nothing is identified."
        for step in (Step.MODEL, Step.EXPORT):
            yield StepState(step, Status.BLOCKED, text, Step.IDENTIFY)
        return
    if work.has_viewed:
        text = "Simulation and measurement were compared."
        if work.require_open_log().source.name not in work.require_outcome().twins:
            text = "The log shown was not fitted; choose a fitted one."
        yield StepState(Step.MODEL, Status.DONE, text)
    else:
        yield StepState(Step.MODEL, Status.OPEN, "Compare simulation and measurement.")
    yield _assess_export(work)


def _assess_export(work: SessionState) -> StepState:
    if work.has_exported:
        return StepState(Step.EXPORT, Status.DONE, "A file was exported.")
    files = "report or model" if work.bus is None else "report or result"
    return StepState(Step.EXPORT, Status.OPEN, f"Download {files}.")


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
