# SPDX-License-Identifier: MIT
"""Evidence of the likelihood method: what the fit leaves over, and what sensor errors would do."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

from drivetwin._util.display_units import significant
from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.coloured_noise import BLOCK
from drivetwin.estimation.likelihood.diagnostics.residual_tests import (
    EXCESS,
    SIGNIFICANT,
    ResidualTest,
    residual_tests,
    white_residuals,
)
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.uncertainty.sensor_tolerance import sensitivity
from drivetwin.report.figures.residuals import residual_figure, residual_panels
from drivetwin.report.figures.sensitivity import sensitivity_figure
from drivetwin.report.figures.shift_phases import shift_spans
from drivetwin.report.labels import channel_label
from drivetwin.report.sections.blocks import (
    Block,
    Cell,
    FigureBlock,
    Section,
    TableBlock,
    Tone,
    link_of,
)
from drivetwin.shifts.shift import shift_labels


def likelihood_sections(found: Identification) -> list[Section]:
    """Build the sections on goodness of fit and sensor sensitivity; empty without a fit."""
    fit = found.evidence.likelihood
    if fit is None:
        return []
    return [_fit_section(found, fit), _sensor_section(found, fit)]


def _fit_section(found: Identification, fit: LikelihoodFit) -> Section:
    labels = _labels(found.evidence.signals)
    tests = residual_tests(fit).values()
    blocks: list[Block] = [_test_table(list(zip(labels, tests, strict=True)))]
    for label, shift, residuals in zip(
        labels, found.shifts, white_residuals(fit).values(), strict=True
    ):
        phases = shift_spans(shift)
        text = (
            f"Shift {label}: residual of each output, averaged over "
            f"{1e3 * BLOCK:.0f} ms and divided by what noise alone would leave. A stretch outside "
            "the dashed lines is where the vehicle does something that the model does not know."
        )
        blocks.append(
            FigureBlock(
                residual_figure(residuals, phases), text, residual_panels(residuals), link_of(shift)
            )
        )
    return Section(
        "fit",
        "The likelihood fit",
        f"All shifts together: {fit.problem.size:,} samples, {len(fit.point.names)} unknowns, "
        f"misfit per sample {fit.chi2:.2f} (1 where noise explains everything; above 1 all "
        "intervals are widened). Noise of the inputs is part of the model.",
        blocks,
    )


def _labels(signals: Sequence[ShiftSignals]) -> list[str]:
    """List the shifts, with their logs if there are several."""
    labels = []
    for log, group in groupby(signals, key=lambda one: one.log):
        names = shift_labels([one.shift for one in group])
        labels += [f"{name} of log {log}" if log else name for name in names]
    return labels


def _test_table(tests: Sequence[tuple[str, Sequence[ResidualTest]]]) -> TableBlock:
    """Excess power and correlation with the inputs, by shift and output."""
    sources = dict.fromkeys(
        source for _, group in tests for test in group for source in test.correlation
    )
    head = (
        Cell("shift"),
        Cell("residual of"),
        Cell("power of slow part", number=True, note="1 for noise"),
        *(Cell(f"goes with {source}", number=True, note="σ") for source in sources),
    )
    rows = [
        (
            Cell(label),
            Cell(channel_label(test.output)),
            _judged(significant(test.excess, 2), good=test.excess <= EXCESS),
            *(_correlation(test.correlation.get(source)) for source in sources),
        )
        for label, group in tests
        for test in group
    ]
    return TableBlock(
        f"Tests of what is left. Slow part: power of means over {1e3 * BLOCK:.0f} ms against that "
        f"of white noise, doubtful above {EXCESS:g}. Correlation with an input in standard "
        f"deviations of chance, doubtful beyond ±{SIGNIFICANT:g}.",
        head,
        rows,
    )


def _correlation(size: float | None) -> Cell:
    """Format the correlation with one input; a dash if the shift lacks that input."""
    if size is None:
        return Cell("–", number=True)
    return _judged(f"{size:+.1f}".replace("-", "−"), good=abs(size) <= SIGNIFICANT)


def _judged(text: str, *, good: bool) -> Cell:
    return Cell(text, number=True, badge=True, tone=Tone.GOOD if good else Tone.DOUBTFUL)


def _sensor_section(found: Identification, fit: LikelihoodFit) -> Section:
    change = sensitivity(fit, found.evidence.signals, found.friction)
    text = (
        "Change of each result, in per cent of its value, by an error of one sensor: a gain error "
        "of 1 %, an offset of 1 % of the sensor's largest reading, values 1 ms older than their "
        "stamps. "
        "Engine torque T_e, pressures P, output torque T_o, speeds n of gearbox input, output and "
        "wheel; a dot is less than 0.05. Scale a column to the data sheet of your sensor; with the "
        "tolerances on the vehicle card all columns are part of the total intervals."
    )
    return Section(
        "sensors",
        "What a sensor error would do",
        "Noise averages out over a log; an error of a sensor's gain, offset or age does not.",
        [FigureBlock(sensitivity_figure(change), text)],
    )
