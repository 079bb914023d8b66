# SPDX-License-Identifier: MIT
"""Evidence of the likelihood method: residuals of the fit, sensitivity to sensor errors."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from drivetwin._util.display_units import format_significant
from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.coloured_noise import COLOURED_NOISE
from drivetwin.estimation.likelihood.diagnostics.residual_tests import (
    MAX_EXCESS_POWER,
    SIGNIFICANT,
    ResidualTest,
    compute_white_residuals,
    run_residual_tests,
)
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.uncertainty.sensor_tolerance import compute_sensitivity
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
from drivetwin.report.figures.likelihood import (
    plot_residuals,
    plot_sensitivity,
)
from drivetwin.report.figures.recording import get_shift_spans
from drivetwin.report.labels import get_channel_label
from drivetwin.shifts.shift import make_shift_labels


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
