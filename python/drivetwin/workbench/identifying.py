# SPDX-License-Identifier: MIT
"""The identification as a job: one method after the other, each result reported when complete."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from drivetwin._util.progress import TimedStages, notify_progress
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.estimation.analysis.experiment_design import rank_for_weak
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.mechanism import quick
from drivetwin.estimation.result.method import Method
from drivetwin.report.bus import BusOutcome, identify_vehicle
from drivetwin.twin.twin import Twin
from drivetwin.validation.multi_log import Source, identify_together
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.ratio_card import RatioCard
from drivetwin.workbench.jobs import Emit, to_fault

_STAGES = TimedStages("methods", tuple(one.value for one in Method))
_STEPS = {
    one: TimedStages(f"{one.value} method", ("identification", "experiments")) for one in Method
}


@dataclass(frozen=True, eq=False)
class Task:
    """Input of an identification: `card` with the fixed values, shifts with the manual edits.

    With `is_quick` one model is fitted, as in `quick`.
    """

    sources: Sequence[Source]
    card: VehicleCard
    methods: Sequence[Method]
    is_quick: bool = False


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of one method, with a twin for each fitted log by its name.

    `found` holds the validation; it is None if the twins come from a saved workspace, because the
    evidence is not saved.
    """

    method: Method
    twins: Mapping[str, Twin]
    found: Identification | None = None

    @property
    def twin(self) -> Twin:
        """The twin of the first fitted log."""
        return next(iter(self.twins.values()))


@dataclass(frozen=True)
class Refusal:
    """Reason why one method failed, and the remedy."""

    method: Method
    text: str


def identify_all(emit: Emit, task: Task) -> None:
    """Run every method of the task and validate its twin; emits an Outcome or Refusal for each.

    Whatever ends one method, a fault of the program included, leaves the others their turn.
    """
    skipped = {one.value: 0 for one in Method if one not in task.methods}
    stages = replace(_STAGES, counts=skipped)
    for method in task.methods:
        with stages.enter(method.value, f"{method.value} method"):
            emit(_run_method(task, method))


def _run_method(task: Task, method: Method) -> Outcome | Refusal:
    """Run one method; return its outcome, or the reason of its failure."""
    try:
        with _STEPS[method].enter("identification"), quick(task.is_quick):
            made = identify_together(task.sources, task.card, method)
        with _STEPS[method].enter("experiments", "comparing experiments"):
            return Outcome(method, made.twins, rank_for_weak(made.found))
    except Exception as error:
        fault = to_fault(error)
        return Refusal(method, f"{fault.what} -> {fault.remedy}")


@dataclass(frozen=True, eq=False)
class BusTask:
    """Input of an identification of bus logs; `held` are the indices of the logs to predict."""

    logs: Sequence[ShiftLog]
    card: RatioCard
    held: frozenset[int] = frozenset()


def identify_bus_logs(emit: Emit, task: BusTask) -> None:
    """Identify one vehicle from its bus logs; emits a BusOutcome."""
    notify_progress(0.0, "all shifts of the bus logs")
    emit(identify_vehicle(task.logs, task.card, task.held))


def render_bus_report(emit: Emit, outcome: BusOutcome) -> None:
    """Emit the report of bus logs as HTML."""
    emit(outcome.render())


def render_log_report(emit: Emit, found: Identification, logs: Sequence[ShiftLog]) -> None:
    """Emit the report of an identification as HTML; `logs` are those fitted, in order."""
    from drivetwin.report.html import render_joint_report, render_report

    if len(logs) == 1 and not found.evidence.held_out:
        emit(render_report(found, logs[0]))
    else:
        emit(render_joint_report(found, logs))
