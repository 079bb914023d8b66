# SPDX-License-Identifier: MIT
"""Evidence of the likelihood method: residuals of the fit, sensitivity to sensor errors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin._util.display_units import Display, format_significant
from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.uncertainty.sensor_tolerance import (
    DELAY,
    FRICTION,
    SIZE,
    Sensitivity,
    compute_sensitivity,
)
from drivetwin.estimation.result.estimate import Z95
from drivetwin.likelihood.coloured_noise import COLOURED_NOISE, compute_block_means
from drivetwin.likelihood.residual_tests import (
    MAX_EXCESS_POWER,
    SIGNIFICANT,
    ResidualTest,
    compute_white_residuals,
    run_residual_tests,
)
from drivetwin.parameters import get_parameter_spec
from drivetwin.report.blocks import (
    Block,
    Cell,
    Column,
    FigureBlock,
    Section,
    TableBlock,
    Tone,
    make_link,
    make_number,
    make_table,
)
from drivetwin.report.figure import (
    DIVERGING,
    FITTED,
    MEASURED,
    Figure,
    get_channel_display,
    get_channel_label,
    get_channel_symbol,
    get_parameter_label,
    make_axis,
    make_layout,
    make_subplots,
    make_trace,
)
from drivetwin.report.stack import Curve, Panel, Phases, stack_panels
from drivetwin.report.validation import get_shift_spans
from drivetwin.shifts.shift import make_shift_labels

_SIGMA = Display("σ")


def plot_residuals(
    residuals: Mapping[str, tuple[FloatArray, FloatArray]], phases: Phases
) -> Figure:
    """Means of each output's residual over 20 ms blocks; of a right model 95 % lie in ±1.96 σ.

    `residuals` are those of one shift, as `compute_white_residuals` gives them.
    """
    panels = []
    for name, (time, white) in residuals.items():
        middle, means = compute_block_means(time, white)
        ends = middle[[0, -1]]
        bounds = [
            Curve("95 % of noise", ends, np.full(2, bound), FITTED, 1.0, "dash", listed=bound > 0.0)
            for bound in (-Z95, Z95)
        ]
        panels.append(
            Panel(
                get_channel_label(name), _SIGMA, [Curve("mean", middle, means, MEASURED), *bounds]
            )
        )
    return stack_panels(panels, phases, height=110 + 130 * len(panels))


_KINDS = {
    "gain": f"gain + {100 * SIZE:g} %",
    "offset": f"offset of {100 * SIZE:g} % of the largest",
    "delay": f"values {1e3 * DELAY:g} ms older",
}
"""Kinds of errors with their titles, from left to right."""
_FULL_COLOUR = 3.0
"""Change [% of the value] at which the colour is full; the number stands in the cell."""
_DOT = 0.05
"""Change below which a dot stands in place of a number."""
_FOLLOWING = {"matches": "y", "autorange": "reversed", "ticks": "", "showticklabels": False}
"""Axis of a panel whose rows are those of the first one."""
_UPRIGHT = 9
"""Letters of a sensor's name that fit above its column; longer ones are turned."""


def plot_sensitivity(found: Sensitivity) -> Figure:
    """Change of each result [%] by sensor: of gain errors, of offsets, of older values."""
    names = [_format_label(one, found) for one in found.ids]
    change = _scale_changes(found)
    symbols = [get_channel_symbol(error.rsplit(" ", 1)[0]) for error in found.errors]
    angle = -90 if max(map(len, symbols)) > _UPRIGHT else 0
    figure = make_subplots(len(_KINDS) * [1.0], gaps=(0.02, 0.0))
    for column, (kind, title) in enumerate(_KINDS.items(), start=1):
        chosen = [k for k, error in enumerate(found.errors) if error.endswith(kind)]
        figure.add_trace(
            make_trace(
                "heatmap",
                x=[_describe_sensor(found, k) for k in chosen],
                y=names,
                z=np.sign(change[:, chosen]) * np.sqrt(np.abs(change[:, chosen])),
                text=[[_format_number(value) for value in row] for row in change[:, chosen]],
                texttemplate="%{text}",
                zmin=-np.sqrt(_FULL_COLOUR),
                zmax=np.sqrt(_FULL_COLOUR),
                colorscale=DIVERGING,
                showscale=False,
                hovertemplate="%{y} by %{x}: %{text}<extra></extra>",
            ),
            row=1,
            col=column,
        )
        axis = make_axis(title, side="top", tickangle=angle, ticks="")
        figure.update_axes("x", axis, col=column)
    figure.merge_layout(
        **{
            **make_layout(170 + 27 * len(names)),
            "margin": {"l": 70, "r": 20, "t": 80, "b": 20},
            "yaxis": make_axis("", autorange="reversed", ticks=""),
        },
        **{f"yaxis{k}": _FOLLOWING for k in range(2, len(_KINDS) + 1)},
    )
    return figure


def _scale_changes(found: Sensitivity) -> FloatArray:
    """Change (q, e) in per cent of the value; of times in ms."""
    rows = [
        1e3 * change if _is_time(name) else _convert_to_percent(change, value)
        for name, value, change in zip(found.ids, found.values, found.change, strict=True)
    ]
    return np.array(rows)


def _is_time(result_id: str) -> bool:
    """Return True if a result is a time. A time may be zero, so its change is given in ms."""
    return get_parameter_spec(result_id).unit == "s"


def _convert_to_percent(change: FloatArray, value: float) -> FloatArray:
    """Convert a change (e,) to per cent of the value; undefined for 0 unless the change is 0."""
    if value == 0.0:
        return np.where(change == 0.0, 0.0, np.nan)
    return 100.0 * change / abs(value)


def _format_label(result_id: str, found: Sensitivity) -> str:
    if _is_time(result_id):
        return f"{get_parameter_label(result_id)} [ms]"
    if result_id.startswith(FRICTION):
        element = result_id.removeprefix(FRICTION)
        return f"μ ({element}) at {found.slips[element]:.0f} rad/s [%]"
    return f"{get_parameter_label(result_id)} [%]"


def _describe_sensor(found: Sensitivity, k: int) -> str:
    """Name of the sensor, and the size of its offset below it."""
    role, kind = found.errors[k].rsplit(" ", 1)
    if kind != "offset":
        return get_channel_symbol(role)
    display = get_channel_display(role)
    size = format_significant(found.sizes[k] * display.factor, 2)
    return f"{get_channel_symbol(role)}<br>{size}<br>{display.label}"


def _format_number(value: float) -> str:
    if not np.isfinite(value):
        return "–"
    if abs(value) < _DOT:
        return "·"
    return f"{value:+.{0 if abs(value) >= 9.95 else 1}f}".replace("-", "−")


def build_likelihood_sections(found: Identification) -> list[Section]:
    """Build the sections on goodness of fit and sensor sensitivity; empty without a fit."""
    fit = found.evidence.likelihood
    if fit is None:
        return []
    return [_build_fit_section(found, fit), _build_sensor_section(found, fit)]


def _build_fit_section(found: Identification, fit: LikelihoodFit) -> Section:
    labels = _list_labels(found.evidence.signals)
    passed, total = count_consistent_residuals(fit)
    tests = run_residual_tests(fit).values()
    blocks: list[Block] = [_build_test_table(list(zip(labels, tests, strict=True)))]
    for label, shift, residuals in zip(
        labels, found.shifts, compute_white_residuals(fit).values(), strict=True
    ):
        phases = get_shift_spans(shift)
        text = (
            f"Shift {label}: residual of each output, averaged over "
            f"{1e3 * COLOURED_NOISE.block:.0f} ms, over the residual of noise alone. Outside the "
            "dashed lines the model lacks an effect."
        )
        blocks.append(
            FigureBlock(
                plot_residuals(residuals, phases),
                text,
                make_link(shift),
            )
        )
    return Section(
        "fit",
        "The likelihood fit",
        f"All shifts together: {fit.problem.size:,} samples, {len(fit.point.names)} unknowns, "
        f"misfit per sample {fit.chi2:.2f} (1 where noise explains everything; above 1 all "
        "intervals are widened). Noise of the inputs is part of the model. "
        f"{passed} of {total} residual tests passed.",
        blocks,
    )


def count_consistent_residuals(fit: LikelihoodFit) -> tuple[int, int]:
    """Tests of the residuals: how many passed, of how many."""
    tests = [test for group in run_residual_tests(fit).values() for test in group]
    total = sum(1 + len(test.correlation) for test in tests)
    failed = sum(test.is_coloured + len(test.significant) for test in tests)
    return total - failed, total


def _list_labels(signals: Sequence[ShiftSignals]) -> list[str]:
    """List the shifts, with their logs if there are several."""
    labels = []
    for log, group in groupby(signals, key=lambda one: one.log):
        names = make_shift_labels([one.shift for one in group])
        labels += [f"{name} of log {log}" if log else name for name in names]
    return labels


def _build_test_table(tests: Sequence[tuple[str, Sequence[ResidualTest]]]) -> TableBlock:
    """Excess power and correlation with the inputs, by shift and output."""
    sources = dict.fromkeys(
        source for _, group in tests for test in group for source in test.correlation
    )
    columns: Sequence[Column] = (
        *("shift", "residual of"),
        make_number("power of slow part", "1 for noise"),
        *(make_number(f"goes with {source}", "σ") for source in sources),
    )
    rows = []
    for label, group in tests:
        for test in group:
            excess = format_significant(test.excess, 2)
            power = _make_test_cell(excess, good=test.excess <= MAX_EXCESS_POWER)
            goes = (_make_correlation_cell(test.correlation.get(source)) for source in sources)
            rows.append((label, get_channel_label(test.output), power, *goes))
    return make_table(
        f"Residual tests. Slow part: power of means over {1e3 * COLOURED_NOISE.block:.0f} ms "
        f"over that of white noise, doubtful above {MAX_EXCESS_POWER:g}. Correlation with an "
        f"input in standard deviations of chance, doubtful beyond ±{SIGNIFICANT:g}.",
        columns,
        rows,
    )


def _make_correlation_cell(size: float | None) -> Cell | None:
    """Format the correlation with one input; None if the shift lacks that input."""
    if size is None:
        return None
    return _make_test_cell(f"{size:+z.1f}".replace("-", "−"), good=abs(size) <= SIGNIFICANT)


def _make_test_cell(text: str, *, good: bool) -> Cell:
    return Cell(text, number=True, badge=True, tone=Tone.GOOD if good else Tone.DOUBTFUL)


def _build_sensor_section(found: Identification, fit: LikelihoodFit) -> Section:
    change = compute_sensitivity(fit, found.evidence.signals, found.friction)
    text = (
        "Change of each result, in per cent of its value, by an error of one sensor: a gain error "
        "of 1 %, an offset of 1 % of the sensor's largest reading, a delay of 1 ms. "
        "Engine torque T_e, pressures P, output torque T_o, speeds n of gearbox input, output and "
        "wheel; a dot is less than 0.05. Scale a column to the data sheet of your sensor; with the "
        "tolerances on the vehicle card all columns are part of the total intervals."
    )
    return Section(
        "sensors",
        "Sensitivity to sensor errors",
        "Noise averages out over a log; errors of gain, offset and delay of a sensor do not.",
        [FigureBlock(plot_sensitivity(change), text)],
    )
