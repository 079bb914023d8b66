# SPDX-License-Identifier: MIT
"""Phases set by hand, and the identification as a job."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from itertools import pairwise

from drivetwin._util.progress import TimedStages, notify_progress
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import InputError
from drivetwin.estimation.analysis.experiment_design import rank_for_weak
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.likelihood.mechanism import quick
from drivetwin.estimation.result.method import DEFAULT_METHOD
from drivetwin.findings import Code, report
from drivetwin.report.bus import BusOutcome, identify_vehicle
from drivetwin.report.figure import ACCENT, MUTED, Figure
from drivetwin.report.validation import plot_shift_phases
from drivetwin.shifts.quality import compute_shift_quality
from drivetwin.shifts.shift import Shift
from drivetwin.twin.twin import Twin
from drivetwin.validation.validated_model import Source, identify_together
from drivetwin.vehicle.card import RatioCard, VehicleCard
from drivetwin.workbench.jobs import Emit
from drivetwin.workbench.what_if import parse_number

LEAST_PHASE = 5e-3
"""Shortest phase [s] that can be set by hand; only the torque phase may be empty."""
_DECIMALS = 4
"""Decimals of a time [s] in its field: finer than the uncertainty of a boundary."""


class Boundary(StrEnum):
    """Movable phase boundary, in order of time."""

    START = "before_start"
    TORQUE = "torque_start"
    INERTIA = "inertia_start"
    LOCKUP = "lockup"
    END = "after_end"


LABELS = {
    Boundary.START: "1 starts",
    Boundary.TORQUE: "2 torque phase starts",
    Boundary.INERTIA: "3 inertia phase starts",
    Boundary.LOCKUP: "4 lock-up",
    Boundary.END: "4 ends",
}


def get_boundary_times(shift: Shift) -> dict[Boundary, float]:
    """Time of each boundary [s]."""
    return {
        Boundary.START: shift.before[0],
        Boundary.TORQUE: shift.torque_phase[0],
        Boundary.INERTIA: shift.inertia_phase[0],
        Boundary.LOCKUP: shift.lockup_time,
        Boundary.END: shift.after[1],
    }


def get_display_times(shift: Shift) -> dict[Boundary, float]:
    """Time of each boundary [s] as its field shows it."""
    return {one: round(time, _DECIMALS) for one, time in get_boundary_times(shift).items()}


def parse_times(shift: Shift, times: Sequence[float | None]) -> dict[Boundary, float]:
    """Boundaries whose field no longer holds the time it showed, with the one it holds [s].

    `times` are those of the fields in the order of Boundary. One that was left alone keeps its
    unrounded time, and so its uncertainty. Raises InputError where a field holds no time.
    """
    shown = get_display_times(shift)
    if len(times) != len(Boundary):
        raise InputError(f"{len(times)} times for {len(Boundary)} boundaries", "state each once")
    found: dict[Boundary, float] = {}
    for one, time in zip(Boundary, times, strict=True):
        if time is None:
            raise InputError(f"{LABELS[one]!r} has no time", "type one in seconds")
        if time != shown[one]:
            found[one] = float(time)
    return found


def move_boundaries(
    log: ShiftLog, card: VehicleCard, shift: Shift, changes: Mapping[Boundary, float]
) -> Shift:
    """The shift with some boundaries at other times [s]; its quality figures follow.

    Raises InputError where a boundary would pass its neighbour or leave the log.
    """
    times = get_boundary_times(shift)
    changed = {one: time for one, time in changes.items() if abs(time - times[one]) > 1e-9}
    if not changed:
        return shift
    times |= changed
    _check_times(log, times)
    start, torque, inertia, lockup, end = (times[one] for one in Boundary)
    names = ", ".join(LABELS[one] for one in Boundary if one in changed)
    kept = [one for one in shift.findings if one.code is not Code.SET_BY_HAND]
    fresh = replace(
        shift,
        before=(start, torque),
        torque_phase=(torque, inertia),
        inertia_phase=(inertia, lockup),
        after=(lockup, end),
        lockup_time=lockup,
        sigma={key: value for key, value in shift.sigma.items() if Boundary(key) not in changed},
        findings=(*kept, report(Code.SET_BY_HAND, boundaries=names)),
    )
    return replace(fresh, quality=compute_shift_quality(log, card, fresh))


def _check_times(log: ShiftLog, times: Mapping[Boundary, float]) -> None:
    for one, other in pairwise(Boundary):
        least = 0.0 if one is Boundary.TORQUE else LEAST_PHASE
        if times[other] - times[one] < least:
            place = f"is not {least:g} s after" if least else "lies before"
            raise InputError(
                f"{LABELS[other]!r} at {times[other]:.4f} s {place} "
                f"{LABELS[one]!r} at {times[one]:.4f} s",
                "keep the boundaries in order",
            )
    first, last = log["output_speed" if "output_speed" in log else "wheel_speed"].time[[0, -1]]
    if times[Boundary.START] < first or times[Boundary.END] > last:
        raise InputError(
            f"a phase leaves the log, which runs from {first:.3f} s to {last:.3f} s",
            "keep the phases inside the log",
        )


def plot_phases(log: ShiftLog, shift: Shift) -> Figure:
    """The shift with a line at each boundary, to be dragged; the other shapes stay in place."""
    figure = plot_shift_phases(log, shift)
    figure.merge_layout(xaxis={"uirevision": f"{shift.start_gear}-{shift.end_gear}"})
    for one, time in get_boundary_times(shift).items():
        outer = one in (Boundary.START, Boundary.END)
        figure.add_shape(
            type="line",
            name=one.value,
            xref="x",
            yref="paper",
            x0=time,
            x1=time,
            y0=0,
            y1=1,
            line={"color": MUTED if outer else ACCENT, "width": 2, "dash": "dash"},
        )
    return figure


def parse_drag(figure: Figure, change: Mapping[str, object]) -> dict[Boundary, float]:
    """Return the boundaries that a relayout event of `plot_phases` has moved, with time [s]."""
    found: dict[Boundary, float] = {}
    for index, shape in enumerate(figure.layout.shapes):
        time = parse_number(change.get(f"shapes[{index}].x0"))
        if shape.name in set(Boundary) and time is not None:
            found[Boundary(shape.name)] = time
    return found


_STAGES = TimedStages("identification of a session", ("identification", "experiments"))


@dataclass(frozen=True, eq=False)
class Task:
    """Input of an identification: `card` with the fixed values, shifts with the manual edits.

    With `is_quick` one model is fitted, as in `quick`.
    """

    sources: Sequence[Source]
    card: VehicleCard
    is_quick: bool = False


@dataclass(frozen=True, eq=False)
class Outcome:
    """Result of an identification, with a twin for each fitted log by its name.

    `found` holds the validation; it is None if the twins come from a saved workspace, because the
    evidence is not saved.
    """

    twins: Mapping[str, Twin]
    found: Identification | None = None

    @property
    def twin(self) -> Twin:
        """The twin of the first fitted log."""
        return next(iter(self.twins.values()))


def identify_logs(emit: Emit, task: Task) -> None:
    """Identify by the default method and validate the twins; emits an Outcome."""
    with _STAGES.enter("identification"), quick(task.is_quick):
        made = identify_together(task.sources, task.card, DEFAULT_METHOD)
    with _STAGES.enter("experiments", "comparing experiments"):
        emit(Outcome(made.twins, rank_for_weak(made.found)))


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


def emit_report(
    emit: Emit, found: Identification | BusOutcome, logs: Sequence[ShiftLog] = ()
) -> None:
    """Emit the report of a result as HTML; `logs` are those fitted, in order."""
    from drivetwin.report.html import build_report_page, render_page

    if isinstance(found, BusOutcome):
        emit(render_page(found.build_page()))
    else:
        emit(render_page(build_report_page(found, logs)))
