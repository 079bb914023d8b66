# SPDX-License-Identifier: MIT
"""Immutable state of one session: files, mapping, phases, fixed parameters, results, sliders."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import InputError
from drivetwin.report.bus import BusOutcome
from drivetwin.shifts.detect import FoundShifts
from drivetwin.shifts.shift import Shift
from drivetwin.twin.twin import Twin
from drivetwin.validation.validated_model import Source as FitSource
from drivetwin.vehicle.card import RatioCard, VehicleCard
from drivetwin.vehicle.locks import Lock, apply_locks, check_lock, get_card_lock
from drivetwin.workbench.forms import Corrections
from drivetwin.workbench.identifying import Boundary, BusTask, Outcome, move_boundaries
from drivetwin.workbench.sandboxed_parse import Opened

MOST_LOGS = 6
"""Maximum number of logs of a session."""


@dataclass(frozen=True)
class Source:
    """File in use: display name, path, and upload flag."""

    name: str
    path: Path
    uploaded: bool = False


@dataclass(frozen=True, eq=False)
class OpenLog:
    """A log as read.

    `corrections` are those of the mapping, `moves` the boundaries set by hand [s] by index of the
    shift. `held` are the indices of the parts that are predicted instead of fitted: shifts, or 0
    for a bus log, which is held out whole.
    """

    source: Source
    opened: Opened
    mapping: Path | None = None
    corrections: Corrections = field(default_factory=Corrections)
    shifts: tuple[Shift, ...] = ()
    moves: Mapping[int, Mapping[Boundary, float]] = field(default_factory=dict)
    held: frozenset[int] = frozenset()

    @property
    def fitted(self) -> tuple[Shift, ...]:
        """The shifts that are not held out."""
        return tuple(one for k, one in enumerate(self.shifts) if k not in self.held)

    @property
    def parts(self) -> int:
        """Number of parts that can be held out."""
        return len(self.shifts) if self.opened.ratios is None else 1

    def require_log(self) -> ShiftLog:
        """Return the channels; raise InputError if the log cannot be read."""
        if self.opened.log is None:
            raise InputError(
                f"{self.source.name} cannot be read as mapped",
                "correct the mapping in the step Channels",
            )
        return self.opened.log

    def apply_moves(
        self, card: VehicleCard, index: int, changes: Mapping[Boundary, float]
    ) -> OpenLog:
        """Set boundaries of one shift by hand; none: as detected. Raises InputError."""
        found = self.opened.found
        if found is None or not 0 <= index < len(found.shifts):
            raise InputError("there is no such shift", "choose one of the shifts of the log")
        kept = {**self.moves.get(index, {}), **changes} if changes else {}
        fresh = move_boundaries(self.require_log(), card, found.shifts[index], kept)
        shifts = tuple(fresh if k == index else one for k, one in enumerate(self.shifts))
        moves = {k: v for k, v in {**self.moves, index: kept}.items() if v}
        return replace(self, shifts=shifts, moves=moves)


@dataclass(frozen=True, eq=False)
class SessionState:
    """The state of a session.

    `at` selects one of the `logs`: the views show its channels, phases and simulation. `shift`
    selects the shift of the sliders; `changes` are the sliders (SI) that differ from the identified
    values. `ended` is the reason why the last identification failed; empty if it was completed.
    `bus` is the result of bus logs. `has_viewed` and `has_exported` state whether the result was
    looked at in the step Model, and exported.
    """

    logs: tuple[OpenLog, ...] = ()
    at: int = 0
    card: Source | None = None
    locks: Mapping[str, Lock] = field(default_factory=dict)
    result: Outcome | None = None
    ended: str = ""
    bus: BusOutcome | None = None
    shift: int = 0
    changes: Mapping[str, float] = field(default_factory=dict)
    has_viewed: bool = False
    has_exported: bool = False

    @property
    def log(self) -> Source | None:
        """File of the selected log; None before one is open."""
        return self.logs[self.at].source if self.logs else None

    @property
    def opened(self) -> Opened | None:
        """Contents of the selected log; None before one is open."""
        return self.logs[self.at].opened if self.logs else None

    @property
    def shifts(self) -> tuple[Shift, ...]:
        """Shifts of the selected log."""
        return self.logs[self.at].shifts if self.logs else ()

    @property
    def all_shifts(self) -> tuple[Shift, ...]:
        """Shifts of all logs."""
        return tuple(shift for one in self.logs for shift in one.shifts)

    @property
    def ratios(self) -> RatioCard | None:
        """The card of the ratios alone that is open; None without one."""
        return self.logs[self.at].opened.ratios if self.logs else None

    def set_log(self, fresh: OpenLog) -> SessionState:
        """Replace the selected log after it was read again; results no longer hold."""
        logs = tuple(fresh if k == self.at else one for k, one in enumerate(self.logs))
        return replace(self, logs=logs, shift=0).drop_results()

    def select_log(self, index: int) -> SessionState:
        """Select the log that the views show. Raises InputError."""
        if not 0 <= index < len(self.logs):
            raise InputError("there is no such log", "choose one that is listed")
        return replace(self, at=index, shift=0, changes={})

    def select_shift(self, index: int) -> SessionState:
        """Select another shift of the log. Raises InputError if it does not exist."""
        if not 0 <= index < len(self.shifts):
            raise InputError("there is no such shift", "choose one that is listed")
        return replace(self, shift=index, changes={})

    def remove_log(self, index: int) -> SessionState:
        """Close one of several logs; results no longer hold. Raises InputError."""
        if not 0 <= index < len(self.logs) or len(self.logs) == 1:
            raise InputError("there is no such log to remove", "choose one of several logs")
        logs = tuple(one for k, one in enumerate(self.logs) if k != index)
        at = min(self.at - (index < self.at), len(logs) - 1)
        return replace(self, logs=logs, at=at, shift=0).drop_results()

    def hold_out(self, held: Sequence[frozenset[int]]) -> SessionState:
        """Set the indices of the shifts to predict, log by log. Raises InputError."""
        if len(held) != len(self.logs) or any(
            not own <= set(range(one.parts)) for own, one in zip(held, self.logs, strict=False)
        ):
            raise InputError("there is no such shift", "choose one of the shifts of the log")
        logs = (replace(one, held=own) for one, own in zip(self.logs, held, strict=True))
        return replace(self, logs=tuple(logs))

    def apply_moves(self, index: int, changes: Mapping[Boundary, float]) -> SessionState:
        """Set boundaries of a shift of the selected log by hand; none: as detected."""
        fresh = self.require_open_log().apply_moves(self.require_card(), index, changes)
        logs = tuple(fresh if k == self.at else one for k, one in enumerate(self.logs))
        return replace(self, logs=logs)

    def set_lock(self, parameter_id: str, lock: Lock) -> SessionState:
        """With one parameter locked; a lock as on the card is none. Raises InputError."""
        kept = {name: one for name, one in self.locks.items() if name != parameter_id}
        if check_lock(parameter_id, lock) != get_card_lock(self.require_card(), parameter_id):
            kept[parameter_id] = lock
        return replace(self, locks=kept)

    def drop_results(self) -> SessionState:
        """Before an identification."""
        return replace(
            self, result=None, ended="", bus=None, changes={},
            has_viewed=False, has_exported=False,
        )  # fmt: skip

    def add_result(self, result: Outcome | BusOutcome) -> SessionState:
        """With the result of an identification."""
        if isinstance(result, BusOutcome):
            return replace(self, bus=result)
        return replace(self, result=result, changes={})

    def get_lock(self, parameter_id: str) -> Lock:
        """The lock of a parameter: as set, else as on the card."""
        return self.locks.get(parameter_id) or get_card_lock(self.require_card(), parameter_id)

    def apply_locks_to_card(self) -> VehicleCard:
        """The card as the locks have it."""
        return apply_locks(self.require_card(), self.locks)

    def require_open_log(self) -> OpenLog:
        """Return the selected log; raise InputError if none is open."""
        if not self.logs:
            raise InputError("no log is open", "open one in the step Log")
        return self.logs[self.at]

    def build_sources(self) -> list[FitSource]:
        """Build the input of an identification from all logs.

        Raises InputError for a log that cannot be read, and if no shift is left to fit.
        """
        self.require_card()
        logs = [one.require_log() for one in self.logs]
        if not self.all_shifts:
            raise InputError(
                "the log holds no usable gear shift", "the step Shifts lists the reasons"
            )
        if not any(one.fitted for one in self.logs):
            raise InputError("every shift is held out", "fit at least one in the step Shifts")
        return [
            FitSource(log, FoundShifts(one.shifts, ()), frozenset(k + 1 for k in one.held))
            for log, one in zip(logs, self.logs, strict=True)
            if one.shifts
        ]

    def build_bus_task(self) -> BusTask:
        """Build the input of an identification of bus logs.

        Raises InputError without a card of the ratios, for a log that cannot be read, and if all
        logs are held out.
        """
        if self.ratios is None:
            raise InputError("no card of the ratios is open", "open one in the step Card")
        held = frozenset(k for k, one in enumerate(self.logs) if one.held)
        if len(held) == len(self.logs):
            raise InputError("every log is held out", "fit at least one in the step Shifts")
        return BusTask([one.require_log() for one in self.logs], self.ratios, held)

    def require_opened(self) -> Opened:
        """Return the contents of the selected log; raise InputError if none is open."""
        return self.require_open_log().opened

    def require_card(self) -> VehicleCard:
        """The vehicle card; raises InputError before one is open."""
        card = self.require_opened().card
        if card is None:
            raise InputError("no vehicle card is open", "open or write one in the step Card")
        return card

    def require_log(self) -> ShiftLog:
        """Return the channels of the selected log; raise InputError if it cannot be read."""
        return self.require_open_log().require_log()

    def require_shift(self) -> Shift:
        """Return the selected shift; raise InputError if the log has none."""
        self.require_log()
        self.require_card()
        if not self.shifts:
            raise InputError(
                "the log holds no usable gear shift", "the step Shifts lists the reasons"
            )
        return self.shifts[self.shift]

    def require_outcome(self) -> Outcome:
        """The result that is shown; raises InputError before an identification."""
        if self.bus is not None:
            raise InputError(
                "bus logs give quantities, but no model",
                "download report and result; a model needs a vehicle card and an output torque",
            )
        if self.result is None:
            raise InputError("nothing is identified yet", "press Identify in the step Identify")
        return self.result

    def require_twin(self) -> Twin:
        """The twin of the selected log; raises InputError before an identification."""
        outcome, source = self.require_outcome(), self.require_open_log().source
        if source.name not in outcome.twins:
            raise InputError(
                f"no shift of {source.name} was fitted: load and signal delay of this log are "
                "not in the model",
                "choose a fitted log; the step Identify shows the prediction of this one",
            )
        return outcome.twins[source.name]

    def get_fitted_logs(self) -> list[ShiftLog]:
        """Return the logs of the result that is shown, in the order of the fit."""
        logs = {one.source.name: one.require_log() for one in self.logs}
        return [logs[name] for name in self.require_outcome().twins]
