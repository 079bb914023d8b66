# SPDX-License-Identifier: MIT
"""The report: one HTML file that opens offline and contains plotly.js once, compressed."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Sequence
from importlib.resources import files
from itertools import count
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from drivetwin._util.atomic import write_text
from drivetwin._util.check_arguments import check_arguments
from drivetwin._util.progress import notify_progress
from drivetwin._util.timed_stages import TimedStages
from drivetwin._util.visible_text import escape_text, escape_values
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.multi_log import Several
from drivetwin.report.blocks import Block, FigureBlock, Section
from drivetwin.report.embedded_data import Store, encode_content
from drivetwin.report.figure import Entry, encode_entries
from drivetwin.report.sections.actuators import build_actuator_section
from drivetwin.report.sections.findings import build_findings_section
from drivetwin.report.sections.identifiability import build_limits_section
from drivetwin.report.sections.parameters import build_result_section
from drivetwin.report.sections.provenance import build_provenance_section
from drivetwin.report.sections.stage_results import build_stage_sections
from drivetwin.report.sections.summary import (
    build_friction_section,
    build_shift_section,
    build_validation_section,
)
from drivetwin.report.sections.together import (
    build_holdout_section,
    build_joint_section,
    prefix_log_section,
)

_BELOW_BUTTONS = 30
"""Room above the panels [px] where the page has the zoom buttons outside the figure."""
_OPENING = ("result", "findings", "logs")
"""Sections before that of the held-out shifts."""
PAGE = TimedStages("page", ("sections", "figures"))
"""Stages of a report."""


@check_arguments
def save_report(path: Path | str, found: Identification, log: ShiftLog) -> None:
    """Write the report of an identification; the file appears whole or not at all."""
    write_text(path, render_report(found, log))


def render_report(found: Identification, log: ShiftLog, library: str | None = None) -> str:
    """HTML text of the report; equal inputs give equal text. `library` as in `render_page`."""
    with PAGE.enter("sections"):
        sections = build_report_sections(found, log)
    shifts = ", ".join(f"{shift.start_gear}→{shift.end_gear}" for shift in found.shifts)
    return render_page(
        title=f"Driveline model from {Path(log.source).name}",
        subtitle=f"shift {shifts} · method {found.method.value} · loss law {found.loss_law}",
        sections=sections,
        library=library,
    )


def build_report_sections(found: Identification, log: ShiftLog) -> list[Section]:
    """All sections in reading order; those without content are left out."""
    stages = build_stage_sections(found)
    sections = [
        build_result_section(found),
        build_findings_section(found.findings),
        build_validation_section(found.evidence.validation),
        build_shift_section(found, log),
        *(one for one in stages if not one.collapsed),
        build_friction_section(found),
        build_actuator_section(found),
        *_build_likelihood_sections(found),
        build_limits_section(found),
        build_provenance_section(found),
        *(one for one in stages if one.collapsed),
    ]
    return [section for section in sections if section.blocks]


def _build_likelihood_sections(found: Identification) -> list[Section]:
    """Build the sections of a likelihood fit, whose modules take long to load; none without one."""
    if found.evidence.likelihood is None:
        return []
    from drivetwin.report.sections.likelihood import build_likelihood_sections

    return build_likelihood_sections(found)


def save_joint_report(path: Path | str, found: Identification, logs: Sequence[ShiftLog]) -> None:
    """Write the report; the file appears whole or not at all. `logs` are those fitted, in order."""
    write_text(path, render_joint_report(found, logs))


def render_joint_report(found: Identification, logs: Sequence[ShiftLog]) -> str:
    """HTML text of the report; equal inputs give equal text."""
    several = found.evidence.several
    held = found.evidence.held_out
    with PAGE.enter("sections"):
        if several is None:
            sections = build_report_sections(found, logs[0])
        else:
            sections = list(_build_joint_sections(found, several, logs))
    if held:
        place = sum(section.anchor in _OPENING for section in sections)
        sections.insert(place, build_holdout_section(found, held))
    names = " and ".join(Path(log.source).name for log in logs)
    predicted = f" · {_format_shift_count(len(held))} predicted" if held else ""
    return render_page(
        title=f"Driveline model from {names}",
        subtitle=(
            f"{_format_shift_count(len(found.shifts))} fitted{predicted} · method "
            f"{found.method.value} · "
            f"loss law {found.loss_law}"
        ),
        sections=[section for section in sections if section.blocks],
    )


def _format_shift_count(count: int) -> str:
    return "1 shift" if count == 1 else f"{count} shifts"


def _build_joint_sections(
    found: Identification, several: Several, logs: Sequence[ShiftLog]
) -> Iterator[Section]:
    """The sections of all logs in reading order; stages of single shifts are in their reports."""
    from drivetwin.estimation.multi_log.fit import extract_log

    yield build_result_section(found)
    yield build_findings_section(found.findings)
    yield build_joint_section(found, several)
    for share, log in zip(several.logs, logs, strict=True):
        own = {id(shift) for shift in share.shifts}  # a log that was not simulated has no runs
        runs = tuple(run for run in found.evidence.validation if id(run.shift) in own)
        yield prefix_log_section(build_validation_section(runs), share)
        yield prefix_log_section(build_shift_section(extract_log(found, share), log), share)
    yield build_friction_section(found)
    yield from _build_likelihood_sections(found)
    yield build_limits_section(found)
    yield build_provenance_section(found)


def render_page(
    title: str, subtitle: str, sections: list[Section], library: str | None = None
) -> str:
    """Fill the page template; figures become JSON that the page's script draws.

    The samples of figures over time stand once, packed, at the end of the page. So does plotly.js,
    unless `library` names a file of `save_library` beside the page, which many pages can share.
    """
    store = Store()
    figures = sum(isinstance(block, FigureBlock) for one in sections for block in one.blocks)
    drawn = count(1)

    def as_json(block: FigureBlock) -> Markup:
        notify_progress(next(drawn) / (figures + 1))
        return encode_figure(block, store)

    with PAGE.enter("figures"):
        return (
            _make_environment(as_json)
            .get_template("report.html.j2")
            .render(
                title=title,
                subtitle=subtitle,
                sections=sections,
                style=read_template("status.css") + read_template("report.css"),
                script=read_template("report.js"),
                samples_index=lambda: _encode_json(store.index),
                samples=lambda: Markup(store.encode()),
                library=library,
                plotly_js=Markup("" if library else _load_encoded_library()),
            )
        )


def render_fragment(blocks: Sequence[Block]) -> str:
    """Return blocks as HTML without figures and style, for a page of others."""
    shown = [one for one in blocks if not isinstance(one, FigureBlock)]
    template = _make_environment(str).get_template("blocks.html.j2")
    return str(template.make_module().render_blocks(shown))  # type: ignore[attr-defined]


def _make_environment(encode: Callable[[FigureBlock], str]) -> Environment:
    """Make the environment of the templates, in which `encode` converts a figure to JSON."""
    environment = Environment(
        loader=PackageLoader("drivetwin.report"),
        autoescape=True,
        finalize=_show,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["figure_json"] = encode
    return environment


def save_library(path: Path) -> None:
    """Write plotly.js as a file that pages with `library` load; it works without a network."""
    script = (
        'const script = document.createElement("script");'
        'script.type = "application/gzip"; script.id = "plotly";'
        f'script.textContent = "{_load_encoded_library()}"; document.body.append(script);'
    )
    write_text(path, "{" + script + "}\n")


def _load_encoded_library() -> str:
    return encode_content(files("plotly").joinpath("package_data", "plotly.min.js").read_bytes())


def encode_figure(block: FigureBlock, store: Store) -> Markup:
    """JSON of a figure, safe inside a script element: traces, layout, zooms, and of a figure over
    time the numbers of each curve's times and values in `store`."""
    layout = dict(block.figure.layout)
    menus = layout.pop("updatemenus", [])
    buttons = [button for menu in menus for button in menu.buttons]
    curves = [
        (store.add_time(curve.time), store.add_values(panel.display.to_display(curve.values)))
        for panel in block.figure.panels
        for curve in panel.curves
    ]
    count = len(curves)
    stored = [{**trace, "x": None, "y": None} for trace in block.figure.data[:count]]
    if buttons:
        layout["margin"] = {**layout["margin"], "t": _BELOW_BUTTONS}
    return _encode_json(
        {
            "data": encode_entries([*map(Entry, stored), *block.figure.data[count:]]),
            "layout": encode_entries(layout),
            "zooms": [{"label": one.label, "change": one.args[0]} for one in buttons],
            "curves": curves,
            "link": block.link,
        }
    )


def _encode_json(value: object) -> Markup:
    return Markup(json.dumps(escape_values(value), separators=(",", ":")).replace("<", "\\u003c"))


def _show(value: object) -> object:
    """Return a value of the template as displayed: texts of others with escapes."""
    return escape_text(value) if isinstance(value, str) and not isinstance(value, Markup) else value


def read_template(name: str) -> Markup:
    """Return the text of a style sheet or script of pages."""
    return Markup(files("drivetwin.report").joinpath("templates", name).read_text("utf-8"))
