# SPDX-License-Identifier: MIT
"""The report: one HTML file that opens offline and contains plotly.js once, compressed.

All samples of its time figures stand in it, each array once, as whole numbers of a step, their
differences in two bytes, and all of that gzip. The step of values is a sixteenth of their own
noise, or 2⁻¹⁶ of their span where they have less noise than that: no eye and no zoom sees it.
Times on an even grid are three numbers, other times have eight bytes. The script of the page,
`templates/report.js`, reads it.
"""

from __future__ import annotations

import base64
import gzip
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from importlib.resources import files
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from drivetwin._util.arrays import FloatArray
from drivetwin._util.atomic import write_text
from drivetwin._util.check_arguments import check_arguments
from drivetwin._util.progress import TimedStages, notify_progress
from drivetwin._util.text import escape_text
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.identification import Identification, Several
from drivetwin.report.blocks import (
    Block,
    FigureBlock,
    Page,
    Section,
    TextBlock,
    build_findings_section,
)
from drivetwin.report.figure import Entry, encode_entries
from drivetwin.report.model_verdict import build_verdict_block, explain_identification
from drivetwin.report.parameters import (
    build_limits_section,
    build_parameter_blocks,
    build_result_section,
    build_suggestion_blocks,
)
from drivetwin.report.stage_results import build_stage_sections
from drivetwin.report.summary import (
    build_actuator_section,
    build_fit_table,
    build_friction_section,
    build_friction_table,
    build_phase_table,
    build_provenance_section,
    build_shift_section,
    build_validation_section,
)
from drivetwin.report.together import (
    build_holdout_section,
    build_joint_section,
    build_judgement_blocks,
    build_log_table,
    prefix_log_section,
)
from drivetwin.shifts.shift import Shift, make_shift_labels

NOISE_PARTS = 16.0
SPAN_PARTS = 65534.0
GAP = 65535
"""Code of a sample that is not finite."""
_COMPRESSION = 4
"""Level of gzip: the highest takes twice the time for four parts in a hundred."""
EVEN = 0.01
"""Largest deviation of a time from an even grid, as a share of its step."""


@dataclass
class Store:
    """Numbered arrays without duplicates; `index` describes the encoding of each in the bytes."""

    index: list[dict[str, Any]] = field(default_factory=list)
    _bytes: list[bytes] = field(default_factory=list)
    _known: dict[object, int] = field(default_factory=dict)

    def add_time(self, time: FloatArray) -> int:
        """Number of a time base (n,), increasing [s]."""
        if not _is_even(time):
            return self._add({"count": time.size, "width": 8}, time.astype("<f8").tobytes())
        step = float(time[-1] - time[0]) / (time.size - 1)
        return self._add({"count": time.size, "start": float(time[0]), "step": step})

    def add_values(self, values: FloatArray) -> int:
        """Number of an array (n,); samples that are not finite are gaps."""
        known = np.isfinite(values)
        start = float(values.min(initial=np.inf, where=known)) if known.any() else 0.0
        step = _choose_value_step(values[known])
        codes = np.full(values.size, GAP, "<u2")
        codes[known] = np.round((values[known] - start) / step)
        entry = {"count": values.size, "width": 2, "start": start, "step": step}
        return self._add(entry, np.diff(codes, prepend=codes.dtype.type(0)).tobytes())

    def encode(self) -> str:
        """All bytes as base64 of gzip; equal stores give equal texts."""
        return encode_content(b"".join(self._bytes))

    def _add(self, entry: dict[str, Any], content: bytes = b"") -> int:
        key = (*entry.values(), content)
        if key not in self._known:
            self._known[key] = len(self.index)
            self.index.append(entry)
            self._bytes.append(content)
        return self._known[key]


def encode_content(content: bytes) -> str:
    """Base64 of gzip; equal contents give equal texts."""
    packed = gzip.compress(content, _COMPRESSION, mtime=0)
    return base64.b64encode(packed).decode("ascii")


def _is_even(time: FloatArray) -> bool:
    if time.size < 3:
        return False
    grid = np.linspace(time[0], time[-1], time.size)
    return bool(np.abs(time - grid).max() <= EVEN * (grid[1] - grid[0]))


def _choose_value_step(known: FloatArray) -> float:
    """Rounding of finite samples that is small against their noise."""
    noise = 0.0
    if known.size >= 4:
        noise = float(np.median(np.abs(np.diff(known, 2)))) / (0.6745 * np.sqrt(6.0))
    span = float(np.ptp(known)) if known.size else 0.0
    return max(noise / NOISE_PARTS, span / SPAN_PARTS, 1e-12)


_BELOW_BUTTONS = 30
"""Room above the panels [px] where the page has the zoom buttons outside the figure."""
_OPENING = ("result", "findings", "logs")
"""Sections before that of the held-out shifts."""
PAGE = TimedStages("page", ("sections", "figures"))
"""Stages of a report."""


@check_arguments
def save_report(path: Path | str, found: Identification, log: ShiftLog) -> None:
    """Write the report of an identification; the file appears whole or not at all."""
    save_page(path, build_report_page(found, [log]))


def build_report_sections(found: Identification, log: ShiftLog) -> list[Section]:
    """All sections in reading order; some may be without content."""
    return [
        build_result_section(found),
        build_findings_section(found.findings),
        build_validation_section(found.evidence.validation),
        build_shift_section(found, log),
        *build_stage_sections(found),
        build_friction_section(found),
        build_actuator_section(found),
        *_build_likelihood_sections(found),
        build_limits_section(found),
        build_provenance_section(found),
    ]


def _build_likelihood_sections(found: Identification) -> list[Section]:
    """Build the sections of a likelihood fit, whose modules take long to load; none without one."""
    if found.evidence.likelihood is None:
        return []
    from drivetwin.report.likelihood import build_likelihood_sections

    return build_likelihood_sections(found)


def build_report_page(found: Identification, logs: Sequence[ShiftLog]) -> Page:
    """Build the report of an identification; `logs` are those fitted, in order."""
    several, held = found.evidence.several, found.evidence.held_out
    shifts = f"shift {', '.join(shift.name for shift in found.shifts)}"
    with PAGE.enter("sections"):
        if several is None:
            sections = build_report_sections(found, logs[0])
        else:
            shifts = f"{len(found.shifts)} shifts"
            sections = list(_build_joint_sections(found, several, logs))
    if held:
        shifts += f", {len(held)} more predicted"
        place = sum(section.anchor in _OPENING for section in sections)
        sections.insert(place, build_holdout_section(found, held))
    return Page(
        title=f"Driveline model from {' and '.join(Path(log.source).name for log in logs)}",
        subtitle=f"{shifts} · method {found.method.value} · loss law {found.loss_law}",
        sections=sections,
    )


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


def build_identification_blocks(found: Identification) -> list[Block]:
    """Verdict, phases, parameters, friction, suggestions, fits, and the findings at the end."""
    evidence = found.evidence
    blocks: list[Block] = [build_verdict_block(explain_identification(found))]
    blocks += [build_phase_table(*one) for one in _label_shifts(found)]
    blocks += build_parameter_blocks(found.estimates)
    if found.friction:
        blocks.append(build_friction_table(found.friction))
    if evidence.suggestions:
        blocks += build_suggestion_blocks(evidence.suggestions, found.estimates)
    if evidence.several is not None:
        blocks += [
            build_log_table(found, evidence.several),
            TextBlock(evidence.several.consistency.text),
        ]
    elif found.fit:
        blocks.append(build_fit_table(found.fit))
    if evidence.held_out:
        blocks += build_judgement_blocks(found, evidence.held_out)
    return [*blocks, *build_findings_section(found.findings).blocks]


def _label_shifts(found: Identification) -> Iterator[tuple[str, Shift]]:
    """Yield the shifts that were fitted with their labels, of several logs with the file too."""
    several = found.evidence.several
    if several is None:
        yield from zip(make_shift_labels(found.shifts), found.shifts, strict=True)
        return
    for log in several.logs:
        for label, shift in zip(make_shift_labels(log.shifts), log.shifts, strict=True):
            yield f"{label} in {Path(log.source).name}", shift


def save_page(path: Path | str, page: Page, library: str | None = None) -> None:
    """Write a page; the file appears whole or not at all. `library` as in `render_page`."""
    write_text(path, render_page(page, library))


def render_page(page: Page, library: str | None = None) -> str:
    """Fill the page template; equal pages give equal text.

    Figures become JSON that the script of the page draws. The samples of figures over time stand
    once, packed, at the end of the page. So does plotly.js, unless `library` names a file of
    `save_library` beside the page, which many pages can share.
    """
    store, sections = Store(), [one for one in page.sections if one.blocks]
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
                title=page.title,
                subtitle=page.subtitle,
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
            "data": [*map(Entry, stored), *block.figure.data[count:]],
            "layout": layout,
            "zooms": [{"label": one.label, "change": one.args[0]} for one in buttons],
            "curves": curves,
            "link": block.link,
        }
    )


def _encode_json(value: object) -> Markup:
    return Markup(json.dumps(encode_entries(value), separators=(",", ":")).replace("<", "\\u003c"))


def _show(value: object) -> object:
    """Return a value of the template as displayed: texts of others with escapes."""
    if isinstance(value, Markup) or not isinstance(value, str) or value.isprintable():
        return value
    return escape_text(value)


def read_template(name: str) -> Markup:
    """Return the text of a style sheet or script of pages."""
    return Markup(files("drivetwin.report").joinpath("templates", name).read_text("utf-8"))
