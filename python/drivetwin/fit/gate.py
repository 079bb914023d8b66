# SPDX-License-Identifier: MIT
"""Gate of a fit: the simulation against the recordings, output by output."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.coloured_noise import split_whitened
from drivetwin.estimation.result.estimate import Estimate, SignalFit, Verdict
from drivetwin.estimation.result.status import ModelStatus
from drivetwin.findings import Code, Finding, Severity, report
from drivetwin.fit.term import NetworkTerm


@dataclass(frozen=True)
class FitGateSettings:
    """Limits of the simulation of a fit."""

    plausible_chi2: float = 2.0
    """Q per sample above which the model does not explain the recordings [-]."""
    largest_error: float = 5.0
    """Root mean square of the normalised residual of an output from which it is no chance [-]."""
    least_fit: float = 50.0
    """Fit of an output [%] below which half of what moves is not explained."""


FIT_GATE = FitGateSettings()


def find_failures(
    parts: Sequence[NetworkTerm],
    residuals: Sequence[FloatArray],
    fits: Sequence[Mapping[str, SignalFit]],
    chi2: float,
) -> Iterator[Finding]:
    """Find recordings and outputs that the simulation does not explain."""
    if chi2 > FIT_GATE.plausible_chi2:
        yield report(Code.RESIDUAL_UNEXPLAINED, chi2=chi2)
    for part, residual, fit in zip(parts, residuals, fits, strict=True):
        where = f" of {part.label}" if part.label else ""
        for out, _, white in split_whitened(part, residual):
            if float(np.sqrt(np.mean(white**2))) > FIT_GATE.largest_error:
                percent = fit[out.name].fit_percent
                yield report(Code.SIMULATION_MISSES, channel=out.name + where, fit=percent)


def find_doubts(
    parts: Sequence[NetworkTerm],
    fits: Sequence[Mapping[str, SignalFit]],
    failures: Sequence[Finding],
) -> Iterator[Finding]:
    """Find outputs of which the simulation explains less than half, beside the `failures`."""
    failed = {one.names["channel"] for one in failures if one.code is Code.SIMULATION_MISSES}
    for part, fit in zip(parts, fits, strict=True):
        where = f" of {part.label}" if part.label else ""
        for name, one in fit.items():
            if one.fit_percent < FIT_GATE.least_fit and name + where not in failed:
                code = Code.SIMULATION_NOISY
                yield report(code, channel=name + where, fit=one.fit_percent)


def judge_status(
    failures: Sequence[Finding], findings: Sequence[Finding], estimates: Mapping[str, Estimate]
) -> ModelStatus:
    """Return the status of the model."""
    if failures:
        return ModelStatus.NOT_VALID
    weak = (Verdict.WEAK, Verdict.NOT_IDENTIFIABLE)
    limited = any(one.severity is Severity.ERROR for one in findings)
    limited |= any(one.verdict in weak for one in estimates.values())
    return ModelStatus.LIMITED if limited else ModelStatus.VALID
