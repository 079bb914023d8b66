# SPDX-License-Identifier: MIT
"""Estimates of one identification and their joint distribution, shared by both methods."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.data.shift_data import ShiftSignals
from drivetwin.estimation.result.cause import Cause, PredictedSpread
from drivetwin.estimation.result.estimate import Z95, CardNumber, Estimate, FrictionCurve, LoadLaw
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.shifts.shift import make_shift_labels


@dataclass(frozen=True, eq=False)
class JointCovariance:
    """Total `covariance` (n, n) over `ids`: parameters, and coefficients of friction laws by
    `make_law_id`."""

    ids: tuple[str, ...]
    covariance: FloatArray


@dataclass(frozen=True, eq=False)
class EstimateSet:
    """Estimates and findings that the pipeline adds to the Identification.

    `loads` are the loads of the shifts at the output shaft [N m] if they differ, else empty.
    """

    estimates: dict[str, Estimate]
    friction: dict[str, FrictionCurve]
    correlation_ids: tuple[str, ...]
    correlation: FloatArray
    findings: tuple[Finding, ...]
    load: LoadLaw | None = None
    loads: tuple[float, ...] = ()
    spread: tuple[Mapping[str, PredictedSpread], ...] = ()
    """Predicted spread of the free-running simulation of each shift by signal; likelihood only."""
    cause: Cause | None = None
    """Model mismatch that the log shows; likelihood method only."""
    joint: JointCovariance | None = None
    """Total covariance of parameters and friction laws; likelihood method only."""
    numbers: Mapping[str, CardNumber] = field(default_factory=dict)
    """Number of the card that would narrow each parameter most; likelihood method only."""
    map_changes: Mapping[int, float] = field(default_factory=dict)
    """Relative change of the converter's torque at points of its map; likelihood method only."""


def _check_excitation(signals: ShiftSignals) -> Finding | None:
    """Return a finding if the engine torque is constant in the lower gear."""
    torque = signals.engine_torque.select_span(signals.shift.before).values
    moving, level = float(np.std(torque)), abs(float(np.mean(torque)))
    if moving > 0.03 * level:
        return None
    variation = 100.0 * moving / max(level, 1e-9)
    return report(Code.GEAR_POORLY_EXCITED, variation=variation, gear=signals.shift.start_gear)


def report_growth(aero: float, std: float, mean_speed: float) -> Finding:
    """Report a load that grows with speed, from AERO and its standard deviation."""
    growth = Number(aero, "N*m*s^2/rad^2", Z95 * std)
    return report(Code.LOAD_GROWS, aero=growth, speed=Number(mean_speed, "rad/s"))


def collect_shift_findings(signals: Sequence[ShiftSignals]) -> list[Finding]:
    """Collect the findings of the shifts, each with the label of its shift."""
    labels = collect_shift_labels(signals)
    return [
        finding.set_subject(label)
        for s, label in zip(signals, labels, strict=True)
        for finding in s.shift.findings
    ]


def collect_shift_labels(signals: Sequence[ShiftSignals]) -> list[str]:
    """Return the labels of the shifts: gears, and the lock-up time if a gear change repeats."""
    labels: list[str] = []
    for log, group in groupby(signals, key=lambda one: one.log):
        names = make_shift_labels([one.shift for one in group], to="-")
        labels += [f"log {log}, shift {name}" if log else f"shift {name}" for name in names]
    return labels


def check_excitation(signals: Sequence[ShiftSignals]) -> dict[str, Finding]:
    """Return findings on a constant engine torque in the lower gear by id of affected parameters.

    A gear has none if the torque varies in it before at least one of the shifts.
    """
    notes: dict[str, Finding] = {}
    found = [(s, _check_excitation(s)) for s in signals]
    moved = {s.shift.start_gear for s, note in found if note is None}
    for s, note in found:
        if note is not None and s.shift.start_gear not in moved:
            notes |= {"eta": note}
            notes |= {f"J_prime_{g}": note for g in (s.shift.start_gear, s.shift.end_gear)}
    return notes
