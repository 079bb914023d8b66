# SPDX-License-Identifier: MIT
"""The few things that views are made of: controls, blocks of results, messages, topics, zoom.

Selects are the browser's own: they work with keyboard and screen reader as they are. The script of
the page hands their value to the property `data-value`.
"""

from __future__ import annotations

import functools
import itertools
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import repeat
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

from dash import Dash, Input, Output, Patch, State, dcc, html, no_update, set_props
from dash.dependencies import DashDependency
from dash.development.base_component import Component

from drivetwin.errors import DrivetwinError, Where
from drivetwin.report.blocks import (
    Block,
    Cell,
    FigureBlock,
    NotesBlock,
    Section,
    TableBlock,
    TextBlock,
    Tile,
    TilesBlock,
    VerdictBlock,
)
from drivetwin.report.figure import Figure
from drivetwin.report.stack import Panel, compute_y_ranges
from drivetwin.workbench.session import Session, Sessions
from drivetwin.workbench.session_state import OpenLog
from drivetwin.workbench.views.fields import check_fields
from drivetwin.workbench.what_if import collect_curves, parse_view
from drivetwin.workbench.workspace import LIMITS

P = ParamSpec("P")
R = TypeVar("R")
Id = str | dict[str, str | int]
Content = str | Component

_counter = itertools.count(1)


class Topic(StrEnum):
    """Something of a session that views draw; its number changes when it does."""

    LOG = "log"
    PHASES = "phases"
    RESULTS = "results"
    LIVE = "live"
    FORM = "form"
    LOCKS = "locks"
    STEPS = "steps"
    HELD = "held"
    SELECTION = "selection"


_CONCERNED = {
    Topic.LOG: (Topic.LOG, Topic.PHASES, Topic.RESULTS, Topic.LIVE, Topic.STEPS),
    Topic.PHASES: (Topic.PHASES, Topic.LIVE),
    Topic.RESULTS: (Topic.RESULTS, Topic.LIVE, Topic.STEPS),
    Topic.LIVE: (Topic.LIVE,),
    Topic.FORM: (Topic.FORM,),
    Topic.LOCKS: (Topic.LOCKS,),
    Topic.STEPS: (Topic.STEPS,),
    Topic.HELD: (Topic.HELD, Topic.STEPS),
    Topic.SELECTION: (Topic.SELECTION, Topic.PHASES, Topic.LIVE, Topic.STEPS),
}


def make_attributes(**values: str) -> dict[str, Any]:
    """Attributes with a hyphen, such as `aria_label` for `aria-label`."""
    return {name.replace("_", "-"): value for name, value in values.items()}


def make_topic_id(topic: Topic) -> str:
    """Id of the store whose change redraws what shows a topic."""
    return f"topic-{topic}"


def make_due_id(view: str) -> str:
    """Id of the store that changes when a view has to be drawn: it is shown, and out of date."""
    return f"due-{view}"


def notify_topic(topic: Topic) -> None:
    """Redraw, after the present callback, what shows a topic or follows from it."""
    for one in _CONCERNED[topic]:
        set_props(make_topic_id(one), {"data": next(_counter)})


def notify(text: str, *, fault: bool = False) -> None:
    """Show a message at the head of the page."""
    set_props(
        "message", {"children": text, "className": "message fault" if fault else "message good"}
    )


def notify_opened_log(how: str, log: OpenLog) -> None:
    """Show the result of reading a log, `how` in words: its fault, or the number of its shifts."""
    opened, shifts = log.opened, len(log.shifts)
    if opened.fault:
        notify(f"The log cannot be read as mapped. {replace_options(opened.fault)}", fault=True)
    elif opened.card is None:
        notify(how)
    elif shifts:
        notify(f"{how}: {shifts} usable {'shift' if shifts == 1 else 'shifts'}")
    else:
        notify(f"{how}, but it has no usable shift. The step Shifts lists the reasons", fault=True)


def show_errors(callback: Callable[P, R], unchanged: object = no_update) -> Callable[P, R]:
    """Return the callback with its errors as the message of the page, and `unchanged` then."""

    @functools.wraps(callback)
    def guarded(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            return callback(*args, **kwargs)
        except (DrivetwinError, OSError) as fault:
            notify(_format_fault(fault), fault=True)
            return cast(R, unchanged)

    return guarded


@dataclass(frozen=True, eq=False)
class Page:
    """The application, and the sessions on which its callbacks act."""

    app: Dash
    sessions: Sessions

    def callback(
        self, *arguments: DashDependency, busy: str = ""
    ) -> Callable[[Callable[..., R]], Callable[..., R]]:
        """Register a function of the tab's session and of the values of `arguments`.

        Its errors become the message of the page. The button `busy` is disabled while it runs.
        """
        silent = not any(isinstance(one, Output) for one in arguments)
        running = [(Output(busy, "disabled"), True, False)] if busy else None

        def register(callback: Callable[..., R]) -> Callable[..., R]:
            def act(*values: Any) -> R:
                *given, key = values
                return callback(self.sessions.get(key), *check_fields(callback, given))

            self.app.callback(
                *arguments,
                State("session", "data"),
                running=running,
                prevent_initial_call=True,
            )(show_errors(act, None if silent else no_update))
            return callback

        return register


def _format_fault(fault: DrivetwinError | OSError) -> str:
    """Format a typed error or an OS error as a message; files without their folders."""
    if isinstance(fault, DrivetwinError):
        return replace_options(fault.format_for_shell())
    where = Where(file=None if fault.filename is None else Path(fault.filename).name)
    remedy = "see whether the file is there, its permissions and the free space"
    return str(DrivetwinError(fault.strerror or type(fault).__name__, remedy, where))


def make_choice(
    id: Id, label: str, options: Mapping[str, str], value: str, *, hidden_label: bool = False
) -> Component:
    """A labelled select: `options` are texts by value; read it as the property `data-value`."""
    entries = [
        html.Option(text, value=key, selected="selected" if key == value else None)
        for key, text in options.items()
    ]
    select = html.Select(entries, id=id, className="choice", **make_attributes(data_value=value))
    return _attach_label(label, select, hidden=hidden_label)


def make_field(id: Id, label: str, *, hidden_label: bool = False, **options: Any) -> Component:
    """A labelled input; `options` are those of dcc.Input."""
    return _attach_label(label, dcc.Input(id=id, **options), hidden=hidden_label)


def _attach_label(label: str, control: Component, *, hidden: bool) -> Component:
    text = html.Span(label, className="unseen" if hidden else "label")
    return html.Label([text, control], className="field")


def make_button(text: str, id: Id, *, main: bool = False, **options: Any) -> Component:
    """A button; `main` is the one to press next."""
    style = "main" if main else ""
    return html.Button(text, id=id, type="button", className=style, **options)


def make_upload_button(text: str, purpose: str, target: str) -> Component:
    """Build a button that uploads a file; the store `target` then holds key and name."""
    return html.Button(
        text,
        type="button",
        **make_attributes(data_upload=purpose, data_target=target, data_limit=str(LIMITS[purpose])),
    )


def make_notes(title: str, texts: Iterable[str], tone: str = "doubtful") -> Component:
    """Build a list of sentences under a heading; empty without sentences."""
    items = [html.Li(text) for text in dict.fromkeys(texts)]
    if not items:
        return html.Div()
    return html.Div([html.H3(title), html.Ul(items)], className=f"notes {tone}")


def make_badge(text: str, tone: str) -> Component:
    """A coloured label."""
    return html.Span(text, className=f"badge {tone}")


def make_row(*children: Component) -> Component:
    """Controls side by side."""
    return html.Div(list(children), className="row")


def make_hint(text: str) -> Component:
    """A paragraph of quiet text."""
    return html.P(text, className="hint")


def make_graph(
    id: str, label: str, figure: Figure, *, cursors: bool = False, **config: Any
) -> Component:
    """Build a figure; `label` is its description for screen readers.

    With `cursors` two times can be compared below it, and it can be saved as an image.
    """
    options: Any = {
        "displaylogo": False,
        "responsive": True,
        "modeBarButtons": [["toImage", "zoom2d", "pan2d", "resetScale2d"]],
        **config,
    }
    plot = dcc.Graph(id=id, config=options, figure=figure.to_document(), className="plot")
    parts: list[Component] = [plot]
    if cursors:
        place = make_attributes(data_plot=id, data_label=label)
        parts.append(html.Div(className="cursors", **place))
    return html.Figure(parts, **make_attributes(aria_label=label))


def render_section(section: Section, prefix: str) -> list[Component]:
    """A section under its title; `prefix` makes the ids of its figures its own."""
    intro = [make_hint(section.intro)] if section.intro else []
    blocks = [render_block(block, f"{prefix}-{k}") for k, block in enumerate(section.blocks)]
    return [html.H3(section.title), *intro, *blocks]


def render_block(block: Block, name: str) -> Component:
    """A block; `name` is the id of its figure."""
    match block:
        case VerdictBlock():
            return _render_verdict(block)
        case FigureBlock():
            figure = make_graph(name, block.caption.partition(".")[0], block.figure)
            return html.Div([figure, make_hint(block.caption)])
        case TableBlock():
            return render_table(block)
        case NotesBlock():
            return make_notes(block.heading, block.items, block.tone.value)
        case TextBlock():
            return html.P(block.text)
        case TilesBlock():
            return html.Div([_render_tile(one) for one in block.tiles], className="tiles")


def _render_verdict(block: VerdictBlock) -> Component:
    parts = [
        html.P(f"{block.subject}: {block.status}", className="word"),
        html.P(block.reason),
        html.P([html.Strong("Next:"), f" {block.action}"]),
    ]
    return html.Div(parts, className=f"verdict {block.tone}", role="status")


def _render_tile(tile: Tile) -> Component:
    return html.Div(
        [
            html.Span(tile.label, className="label"),
            html.Strong(tile.value),
            html.Small(tile.note),
        ],
        className=f"tile {tile.tone}",
    )


def render_table(
    block: TableBlock,
    heads: Sequence[str] = (),
    controls: Sequence[Sequence[Component | str]] = (),
    name: str = "",
) -> Component:
    """Render a table of the class `name`; `controls` are the rows of more columns under `heads`."""
    body = [
        html.Tr(
            [
                _render_cell(row[0], html.Th, scope="row"),
                *(_render_cell(one, html.Td) for one in row[1:]),
                *map(html.Td, own),
            ]
        )
        for row, own in zip(block.rows, controls or repeat(()), strict=bool(controls))
    ]
    top = html.Tr(
        [_render_cell(one, html.Th, scope="col") for one in (*block.head, *map(Cell, heads))]
    )
    caption = [html.Caption(block.caption)] if block.caption else []
    table = html.Table([*caption, html.Thead(top), html.Tbody(body)])
    return html.Div(table, className=f"table {name}".strip())


def _render_cell(cell: Cell, kind: type[html.Td] | type[html.Th], **options: Any) -> Component:
    content: list[Component | str] = [
        make_badge(cell.text, cell.tone.value) if cell.badge and cell.text else cell.text
    ]
    if cell.href:
        content = [html.A(cell.text, href=cell.href)]
    content += [html.Small(text) for text in (cell.note, cell.remark) if text]
    name = "number" if cell.number else "text"
    return kind(content, className=f"{name} secondary" if cell.secondary else name, **options)


def register_zoom(page: Page, plot: str, get_panels: Callable[[Session], Sequence[Panel]]) -> None:
    """Draw the figure `plot` anew where it is zoomed; `get_panels` returns its panels."""

    @page.callback(Output(plot, "figure", allow_duplicate=True), Input(plot, "relayoutData"))
    def follow(session: Session, change: dict[str, Any] | None) -> Any:
        """Send the samples in view."""
        view = parse_view(change or {})
        if view is None:
            return no_update
        if session.set_view(view):
            notify_topic(Topic.PHASES)
        panels = get_panels(session)
        patch = Patch()
        for place, curve in collect_curves(panels, view).items():
            patch["data"][place]["x"] = curve["x"]
            patch["data"][place]["y"] = curve["y"]
        patch["layout"]["xaxis"]["range"] = list(view)
        for axis, ends in compute_y_ranges(panels, view).items():
            patch["layout"][axis]["range"] = list(ends)
        return patch


_FIELDS = {
    "--name": "the name of the vehicle",
    "--gearbox": "the built-in gearbox",
    "--ratios": "the ratios of the gears",
    "--gears": "the names of the gears",
    "--elements": "the shift elements",
    "--input-gear": "the input gear",
    "--final-drive": "the final drive",
    "--converter": "the map of the converter",
    "--engine-inertia": "the inertia at the engine",
    "--vehicle-inertia": "the inertia of the vehicle",
    "--mass": "the mass of the vehicle",
    "--wheel-radius": "the wheel radius",
    "--output-inertia": "the inertia of the output side",
    "--element": "the data of the shift elements",
    "--sensor": "the sensor class",
    "--vehicle": "a vehicle card",
    "--channels": "the step Channels",
    "--method likelihood": "the likelihood method",
    "--shift": "the choice of the shift",
}
"""Field or step of the page in place of an option."""
_COMMANDS = {
    "inspect": "the step Channels",
    "shifts": "the step Shifts",
    "identify": "the step Identify",
    "export": "the step Report and export",
    "app": "the program",
}
"""Step of the page in place of a command."""
_PHRASES = (
    (
        r"(?:assert|name|choose|give) (?P<thing>the units|its column|it|one|the channel) in a "
        r"channel mapping(?: file)? \(--channels[^)]*\)(?: or in \[channels\] of the card)?",
        r"correct \g<thing> in the step Channels",
    ),
    (r"map (?P<thing>.{1,400}) with --channels", r"give \g<thing> a role in the step Channels"),
    (
        r'assert it in the channel mapping[^:,]*[:,] time = \{ unit = "\w+" \}(?: \(or [^)]*\))?',
        "state the unit of the time column in the step Channels",
    ),
    (
        r"check its unit of time; the channel mapping asserts one: time = .*",
        "correct the unit of the time column in the step Channels",
    ),
    (r", if they are these: channels\..*", ""),
    (
        r"assert it in the channel mapping[^:]*: channels\.\S+ = \{[^}]*\}",
        "correct it in the step Channels",
    ),
    (r" \('drivetwin inspect LOG --write-mapping[^']*' begins one\)", ""),
    (r" \('drivetwin examine --friction free'\)", ""),
    (r"state them by these options, or run .*", "answer them in the form"),
    (
        r"name (?P<thing>it|one) in a channel mapping",
        r"correct \g<thing> in the step Channels",
    ),
)
"""Whole phrases that speak of options, with their replacement."""
_OPTION = re.compile("|".join(rf"{one}(?![\w-])" for one in sorted(_FIELDS, key=len, reverse=True)))
_COMMAND = re.compile(r"'drivetwin (?P<name>[a-z]+)[^']*'")


def replace_options(text: str) -> str:
    """Return a message with steps and fields of the page in place of options and commands."""
    for phrase, words in _PHRASES:
        text = re.sub(phrase, words, text)
    text = _OPTION.sub(lambda found: _FIELDS[found.group()], text)
    return _COMMAND.sub(lambda found: _COMMANDS.get(found["name"], "the workbench"), text)
