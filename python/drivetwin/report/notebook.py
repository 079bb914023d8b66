# SPDX-License-Identifier: MIT
"""Figures and summaries of results for notebooks: what `DisplayMixin` objects answer with."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import singledispatch
from typing import TYPE_CHECKING

import numpy as np
from markupsafe import Markup, escape

from drivetwin._util.display_units import format_significant, format_uncertainty, get_display_unit
from drivetwin._util.visible_text import escape_text
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Z95, Estimate, SignalFit
from drivetwin.estimation.result.validation import Validation
from drivetwin.findings import render
from drivetwin.report.data_frames import make_frame
from drivetwin.report.figure import Figure
from drivetwin.report.figures.comparison import plot_friction_overlay
from drivetwin.report.figures.parameters import plot_intervals
from drivetwin.report.figures.recording import QUANTITIES, plot_log
from drivetwin.report.figures.validation import plot_validation
from drivetwin.report.labels import get_channel_label, get_channel_unit
from drivetwin.twin.twin import Twin

if TYPE_CHECKING:
    import plotly.graph_objects as go

__all__ = ["Summary", "Table", "draw_figure", "make_frame", "summarise"]

Row = Sequence[str]


@dataclass(frozen=True)
class Table:
    """A small table: `head` and `rows` of texts; columns in `right` are aligned to the right."""

    head: Row
    rows: Sequence[Row]
    right: frozenset[int] = frozenset()


@dataclass(frozen=True, repr=False)
class Summary:
    """A title, tables and remarks, as text and as HTML."""

    title: str
    tables: Sequence[Table]
    remarks: Sequence[str] = ()

    def __str__(self) -> str:
        parts = [self.title, *(_format_text(table) for table in self.tables), *self.remarks]
        return escape_text("\n\n".join(part for part in parts if part))

    __repr__ = __str__

    @property
    def html(self) -> str:
        """Plain HTML that takes the notebook's own colours."""
        tables = "".join(_format_html(table) for table in self.tables)
        remarks = "".join(f"<li>{_escape(text)}</li>" for text in self.remarks)
        listed = f"<ul>{remarks}</ul>" if remarks else ""
        return f"<div><strong>{_escape(self.title)}</strong>{tables}{listed}</div>"

    def _repr_html_(self) -> str:
        return self.html


def _format_text(table: Table) -> str:
    """Aligned columns, two spaces apart."""
    lines = [table.head, *table.rows]
    widths = [max(len(line[k]) for line in lines) for k in range(len(table.head))]

    def row(line: Row) -> str:
        padded = (
            text.rjust(width) if k in table.right else text.ljust(width)
            for k, (text, width) in enumerate(zip(line, widths, strict=True))
        )
        return "  ".join(padded).rstrip()

    return "\n".join(
        [row(table.head), "-" * (sum(widths) + 2 * len(widths) - 2), *map(row, table.rows)]
    )


def _format_html(table: Table) -> str:
    def cells(line: Row, tag: str) -> str:
        return "".join(
            f'<{tag} style="text-align:{"right" if k in table.right else "left"}">{_escape(text)}'
            f"</{tag}>"
            for k, text in enumerate(line)
        )

    rows = "".join(f"<tr>{cells(row, 'td')}</tr>" for row in table.rows)
    return f"<table><thead><tr>{cells(table.head, 'th')}</tr></thead><tbody>{rows}</tbody></table>"


def draw_figure(thing: object) -> go.Figure:
    """Figure of a result; TypeError for what has none."""
    return _plot(thing).to_plotly()


@singledispatch
def _plot(thing: object) -> Figure:
    raise TypeError(f"no figure of a {type(thing).__name__}")


@singledispatch
def summarise(thing: object) -> Summary:
    """Summary of a result; TypeError for what has none."""
    raise TypeError(f"no summary of a {type(thing).__name__}")


@_plot.register
def _(log: ShiftLog) -> Figure:
    return plot_log(log)


@_plot.register
def _(found: Identification) -> Figure:
    validations = found.evidence.validation
    return plot_validation(validations[0]) if validations else plot_intervals(found.estimates)


@_plot.register
def _(twin: Twin) -> Figure:
    return plot_friction_overlay("the element", twin.friction, list(twin.friction))


@_plot.register
def _(validation: Validation) -> Figure:
    return plot_validation(validation)


@summarise.register
def _(log: ShiftLog) -> Summary:
    rows = []
    for role, one in log.channels.items():
        _, display = QUANTITIES[one.quantity]
        low, high = (
            format_significant(float(value) * display.factor)
            for value in (np.nanmin(one.values), np.nanmax(one.values))
        )
        rate = format_significant(1.0 / one.step, 3)
        rows.append((role, one.source_name, rate, low, high, display.label))
    head = ("role", "channel", "Hz", "from", "to", "unit")
    return Summary(log.source, [Table(head, rows, frozenset({2, 3, 4}))], render(log.findings))


@summarise.register
def _(found: Identification) -> Summary:
    shifts = ", ".join(f"{one.start_gear}→{one.end_gear}" for one in found.shifts)
    return Summary(
        f"{', '.join(found.inputs)}: shift {shifts}, {found.method.value} method",
        [_build_parameter_table(found.estimates.values()), *_build_fit_tables(found.fit)],
        [
            *_collect_reasons(found.estimates.values()),
            *(f"{one.severity}: {one.text}" for one in found.findings),
        ],
    )


@summarise.register
def _(twin: Twin) -> Summary:
    return Summary(
        f"Twin of {twin.name}, {twin.method.value} method",
        [_build_parameter_table(twin.parameters.values())],
        _collect_reasons(twin.parameters.values()),
    )


@summarise.register
def _(validation: Validation) -> Summary:
    shift = validation.shift
    return Summary(
        f"Shift {shift.start_gear}→{shift.end_gear} simulated: {validation.status}",
        list(_build_fit_tables(validation.fit)),
        render(validation.findings),
    )


def _build_parameter_table(estimates: Iterable[Estimate]) -> Table:
    rows = []
    for one in estimates:
        display = get_display_unit(one.unit)
        half = None if one.std_total is None else Z95 * one.std_total * display.factor
        value, width = (
            ("–", "") if one.value is None else format_uncertainty(one.value * display.factor, half)
        )
        rows.append(
            (one.id, value, f"± {width}" if width else "", display.label, one.verdict.value)
        )
    return Table(("parameter", "value", "95 %", "unit", "verdict"), rows, frozenset({1, 2}))


def _collect_reasons(estimates: Iterable[Estimate]) -> list[str]:
    """Collect the reasons of the verdicts, each once with all parameters that share it."""
    shared: dict[str, list[str]] = {}
    for one in estimates:
        if one.reason:
            shared.setdefault(one.reason, []).append(one.id)
    return [f"{', '.join(ids)}: {reason}" for reason, ids in shared.items()]


def _build_fit_tables(fit: Mapping[str, Mapping[str, SignalFit]]) -> Iterable[Table]:
    """The table of fits; none where nothing was simulated."""
    if not fit:
        return
    phases = list(dict.fromkeys(phase for one in fit.values() for phase in one))
    rows = []
    for signal, one in fit.items():
        display = get_display_unit(get_channel_unit(signal))
        error = f"{format_significant(one['all'].rmse * display.factor, 3)} {display.label}"
        fits = [f"{one[p].fit_percent:z.1f}" if p in one else "–" for p in phases]
        rows.append((get_channel_label(signal), *fits, error))
    head = ("fit %", *phases, "rmse")
    yield Table(head, rows, frozenset(range(1, len(head))))


def _escape(text: str) -> Markup:
    """Return a text of others as HTML."""
    return escape(escape_text(text))
