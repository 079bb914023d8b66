# SPDX-License-Identifier: MIT
"""Figures, summaries and data frames of results for notebooks, used by `DisplayMixin`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import singledispatch
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import MissingExtraError
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Estimate, EstimatesMixin, FrictionCurve
from drivetwin.estimation.result.validation import Validation
from drivetwin.fit.result import ModelFit
from drivetwin.report.blocks import Block, TextBlock, build_findings_section, make_table
from drivetwin.report.figure import Figure
from drivetwin.report.fit import build_fit_blocks, plot_recording
from drivetwin.report.html import build_identification_blocks, render_fragment
from drivetwin.report.parameters import (
    build_parameter_blocks,
    plot_intervals,
)
from drivetwin.report.summary import (
    build_fit_table,
    build_friction_table,
)
from drivetwin.report.text import format_blocks
from drivetwin.report.together import (
    plot_friction_overlay,
)
from drivetwin.report.validation import QUANTITIES, plot_log, plot_validation
from drivetwin.twin.twin import Twin
from drivetwin.validation.validated_model import ValidatedModel

if TYPE_CHECKING:
    import plotly.graph_objects as go


@singledispatch
def make_frame(thing: object) -> Any:
    """Make the data frame of a result; TypeError for what has none."""
    raise TypeError(f"no data frame of a {type(thing).__name__}")


@make_frame.register
def _(log: ShiftLog) -> Any:
    """One column per role in SI, over the stamps [s] of all channels; NaN between them."""
    pandas = import_pandas()
    columns = {
        role: pandas.Series(one.values, index=one.time) for role, one in log.channels.items()
    }
    return pandas.DataFrame(columns).rename_axis("time")


@make_frame.register
def _(found: EstimatesMixin) -> Any:
    return _tabulate_estimates(found.estimates)


@make_frame.register
def _(curve: FrictionCurve) -> Any:
    """μ and its 95 % band over the slip [rad/s]."""
    columns = {"mu": curve.mu, "low": curve.mu_lo, "high": curve.mu_hi}
    frame = import_pandas().DataFrame(columns, index=curve.slip)
    return frame.rename_axis("slip")


@make_frame.register
def _(twin: Twin) -> Any:
    return _tabulate_estimates(twin.parameters)


@make_frame.register
def _(validation: Validation) -> Any:
    """Measured beside simulated signals in SI over the time [s] of the simulation."""
    pandas = import_pandas()
    columns = {}
    for name, trace in validation.all_traces.items():
        columns[f"{name}_measured"] = pandas.Series(trace.measured, index=trace.time)
        columns[f"{name}_simulated"] = pandas.Series(trace.simulated, index=trace.time)
    return pandas.DataFrame(columns).rename_axis("time")


def _tabulate_estimates(estimates: Mapping[str, Estimate]) -> Any:
    """One row per parameter: value, deviations and 95 % interval in SI, verdict and reason."""
    rows = {}
    for name, one in estimates.items():
        low, high = one.ci95_total or (None, None)
        rows[name] = {
            "value": one.value,
            "std_noise": one.std_noise,
            "std_total": one.std_total,
            "low": low,
            "high": high,
            "unit": one.unit,
            "verdict": one.verdict.value,
            "reason": one.reason,
        }
    numbers = dict.fromkeys(("value", "std_noise", "std_total", "low", "high"), "float64")
    frame = import_pandas().DataFrame.from_dict(rows, orient="index")
    return frame.astype(numbers).rename_axis("parameter")


def import_pandas() -> Any:
    """Return the module pandas. Raises MissingExtraError with the install command."""
    try:
        return import_module("pandas")
    except ImportError as fault:
        raise MissingExtraError(
            "data frames need pandas, which is not installed", "pip install pandas"
        ) from fault


__all__ = ["Summary", "draw_figure", "make_frame", "summarise"]

_STYLE = ".drivetwin .number{text-align:right}.drivetwin .text{text-align:left}.drivetwin small"
_STYLE += "{display:block;opacity:.7}"


@dataclass(frozen=True, repr=False)
class Summary:
    """A title and blocks, as text and as HTML."""

    title: str
    blocks: Sequence[Block]

    def __str__(self) -> str:
        return format_blocks([TextBlock(self.title), *self.blocks])

    __repr__ = __str__

    @property
    def html(self) -> str:
        """Plain HTML that takes the notebook's own colours."""
        body = render_fragment([TextBlock(self.title), *self.blocks])
        return f'<div class="drivetwin"><style>{_STYLE}</style>{body}</div>'

    def _repr_html_(self) -> str:
        return self.html


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
def _(model: ValidatedModel) -> Figure:
    return _plot(model.result)


@_plot.register
def _(found: ModelFit) -> Figure:
    """Draw the first recording."""
    term, run = found.problem.terms[0], found.simulate()[0]
    return plot_recording(term, found.minimum.point, run)


@_plot.register
def _(curve: FrictionCurve) -> Figure:
    return plot_friction_overlay("the element", {"μ": curve}, ["μ"])


@_plot.register
def _(twin: Twin) -> Figure:
    return plot_friction_overlay("the element", twin.friction, list(twin.friction))


@_plot.register
def _(validation: Validation) -> Figure:
    return plot_validation(validation)


@summarise.register
def _(log: ShiftLog) -> Summary:
    columns = ("role", "channel", ("Hz", "3"), ("from", "4"), ("to", "4"), "unit")
    rows = []
    for role, one in log.channels.items():
        _, display = QUANTITIES[one.quantity]
        low, high = np.nanmin(one.values), np.nanmax(one.values)
        numbers = 1.0 / one.step, display.factor * float(low), display.factor * float(high)
        rows.append((role, one.source_name, *numbers, display.label))
    findings = build_findings_section(log.findings).blocks
    return Summary(log.source, [make_table("", columns, rows), *findings])


@summarise.register
def _(found: Identification) -> Summary:
    shifts = ", ".join(one.name for one in found.shifts)
    title = f"{', '.join(found.inputs)}: shift {shifts}, {found.method.value} method"
    return Summary(title, build_identification_blocks(found))


@summarise.register
def _(model: ValidatedModel) -> Summary:
    return summarise(model.result)


@summarise.register
def _(found: ModelFit) -> Summary:
    logs = [term.label or "recording" for term in found.problem.terms]
    return Summary(f"Fit of {found.model.name}", build_fit_blocks(found, logs, {}))


@summarise.register
def _(curve: FrictionCurve) -> Summary:
    return Summary("Friction curve", [build_friction_table({"μ": curve})])


@summarise.register
def _(twin: Twin) -> Summary:
    title = f"Twin of {twin.name}, {twin.method.value} method"
    return Summary(title, build_parameter_blocks(twin.parameters))


@summarise.register
def _(validation: Validation) -> Summary:
    shift = validation.shift
    title = f"Shift {shift.name} simulated: {validation.status}"
    findings = build_findings_section(validation.findings).blocks
    return Summary(title, [build_fit_table(validation.fit), *findings])
