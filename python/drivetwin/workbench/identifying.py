# SPDX-License-Identifier: MIT
"""The identification as a job: one method after the other, each result reported when complete."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from drivetwin._util.progress import scale_progress
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.analysis.experiment_design import rank_experiments
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.method import Method
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import FoundShifts
from drivetwin.shifts.shift import Shift
from drivetwin.twin.build import build_twin
from drivetwin.twin.twin import Twin
from drivetwin.validation.simulate_log import attach_validation
from drivetwin.vehicle.card import VehicleCard
from drivetwin.workbench.jobs import Emit, to_fault

_WEIGHTS = {Method.PAPER: 1.0, Method.INTEGRAL: 30.0, Method.LIKELIHOOD: 70.0}
"""Relative computing times of the methods."""


@dataclass(frozen=True, eq=False)
class Task:
    """Input of an identification; `card` includes the fixed values, `shifts` the manual edits."""

    log: ShiftLog
    card: VehicleCard
    shifts: tuple[Shift, ...]
    methods: Sequence[Method]


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of one method, with its twin; `found` holds the validation.

    `found` is None if the twin comes from a saved workspace, because the evidence is not saved.
    """

    method: Method
    twin: Twin
    found: Identification | None = None


@dataclass(frozen=True)
class Refusal:
    """Reason why one method failed, and the remedy."""

    method: Method
    text: str


def identify_all(emit: Emit, task: Task) -> None:
    """Run every method of the task and validate its twin; emits an Outcome or Refusal for each.

    Whatever ends one method, a fault of the program included, leaves the others their turn.
    """
    whole, start = sum(_WEIGHTS[method] for method in task.methods), 0.0
    shifts = FoundShifts(task.shifts, ())
    for method in task.methods:
        end = start + _WEIGHTS[method] / whole
        with scale_progress(start, end, f"{method.value} method"):
            emit(_run_method(task, shifts, method))
        start = end


def _run_method(task: Task, shifts: FoundShifts, method: Method) -> Outcome | Refusal:
    """Run one method; return its outcome, or the reason of its failure."""
    try:
        return _make_outcome(task, shifts, method)
    except Exception as error:
        fault = to_fault(error)
        return Refusal(method, f"{fault.what} -> {fault.remedy}")


def _make_outcome(task: Task, shifts: FoundShifts, method: Method) -> Outcome:
    found = identify(task.log, task.card, shifts, method)
    twin = build_twin(found, task.card)
    return Outcome(method, twin, rank_experiments(attach_validation(found, twin, task.log)))


def render_log_report(emit: Emit, found: Identification, log: ShiftLog) -> None:
    """The report of an identification as HTML text; emits it."""
    from drivetwin.report.html import render_report

    emit(render_report(found, log))
