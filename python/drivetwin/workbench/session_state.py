# SPDX-License-Identifier: MIT
"""Immutable state of one session: files, mapping, phases, fixed parameters, results, sliders."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from drivetwin.channels.channel_spec import ChannelSpec
from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import InputError
from drivetwin.estimation.result.method import DEFAULT_METHOD, Method
from drivetwin.shifts.shift import Shift
from drivetwin.twin.twin import Twin
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.locks import Lock, apply_locks, check_lock, get_card_lock
from drivetwin.workbench.identifying import Outcome, Refusal
from drivetwin.workbench.phases import Boundary, move_boundaries
from drivetwin.workbench.sandboxed_parse import Opened


@dataclass(frozen=True)
class Source:
    """File in use: display name, path, and upload flag."""

    name: str
    path: Path
    uploaded: bool = False


@dataclass(frozen=True, eq=False)
class SessionState:
    """The state of a session.

    `channels` are the corrections of the mapping, `moves` the boundaries set by hand [s] by number
    of the shift, `changes` the sliders (SI) that differ from the identified values. `method` and
    `shift` select the result and the shift of the sliders. `ended` is the reason why the last
    identification ended before its last method; empty if it was completed. `has_viewed` and
    `has_exported` state whether the result was looked at in the step Model, and exported.
    """

    log: Source | None = None
    card: Source | None = None
    mapping: Path | None = None
    channels: Mapping[str, ChannelSpec] = field(default_factory=dict)
    opened: Opened | None = None
    shifts: tuple[Shift, ...] = ()
    moves: Mapping[int, Mapping[Boundary, float]] = field(default_factory=dict)
    locks: Mapping[str, Lock] = field(default_factory=dict)
    results: Mapping[Method, Outcome] = field(default_factory=dict)
    refusals: Mapping[Method, str] = field(default_factory=dict)
    ended: str = ""
    method: Method | None = None
    shift: int = 0
    changes: Mapping[str, float] = field(default_factory=dict)
    has_viewed: bool = False
    has_exported: bool = False

    @property
    def verdict_outcome(self) -> Outcome | None:
        """Result of the default method, which alone gives a verdict; None before it."""
        return self.results.get(DEFAULT_METHOD)

    def set_opened(self, opened: Opened) -> SessionState:
        """After a log was read: what was found from another reading no longer holds."""
        shifts = opened.found.shifts if opened.found is not None else ()
        return replace(
            self,
            opened=opened,
            shifts=shifts,
            moves={},
            shift=0,
        ).drop_results()

    def apply_moves(self, index: int, changes: Mapping[Boundary, float]) -> SessionState:
        """With boundaries of one shift set by hand; none: as detected. Raises InputError."""
        log, card = self.require_log(), self.require_card()
        detected = self._get_detected_shift(index)
        kept = {**self.moves.get(index, {}), **changes} if changes else {}
        fresh = move_boundaries(log, card, detected, kept)
        shifts = tuple(fresh if k == index else one for k, one in enumerate(self.shifts))
        moves = {k: v for k, v in {**self.moves, index: kept}.items() if v}
        return replace(self, shifts=shifts, moves=moves)

    def set_lock(self, parameter_id: str, lock: Lock) -> SessionState:
        """With one parameter locked; a lock as on the card is none. Raises InputError."""
        kept = {name: one for name, one in self.locks.items() if name != parameter_id}
        if check_lock(parameter_id, lock) != get_card_lock(self.require_card(), parameter_id):
            kept[parameter_id] = lock
        return replace(self, locks=kept)

    def drop_results(self) -> SessionState:
        """Before an identification."""
        return replace(
            self, results={}, refusals={}, ended="", method=None, changes={},
            has_viewed=False, has_exported=False,
        )  # fmt: skip

    def add_result(self, result: Outcome | Refusal) -> SessionState:
        """With what one method found, which is shown from now on."""
        if isinstance(result, Refusal):
            return replace(self, refusals={**self.refusals, result.method: result.text})
        results = {**self.results, result.method: result}
        return replace(self, results=results, method=result.method, changes={})

    def get_lock(self, parameter_id: str) -> Lock:
        """The lock of a parameter: as set, else as on the card."""
        return self.locks.get(parameter_id) or get_card_lock(self.require_card(), parameter_id)

    def apply_locks_to_card(self) -> VehicleCard:
        """The card as the locks have it."""
        return apply_locks(self.require_card(), self.locks)

    def require_opened(self) -> Opened:
        """Return the opened log; raise InputError if none is open."""
        if self.opened is None:
            raise InputError("no log is open", "open one in the step Log")
        return self.opened

    def require_card(self) -> VehicleCard:
        """The vehicle card; raises InputError before one is open."""
        card = self.require_opened().card
        if card is None:
            raise InputError("no vehicle card is open", "open or write one in the step Card")
        return card

    def require_log(self) -> ShiftLog:
        """Return the log; raise InputError if none is open or it cannot be read."""
        opened = self.require_opened()
        if opened.log is None:
            raise InputError(
                "the log cannot be read as mapped", "correct the mapping in the step Channels"
            )
        return opened.log

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
        if self.method is None:
            raise InputError("nothing is identified yet", "press Identify in the step Identify")
        return self.results[self.method]

    def require_twin(self) -> Twin:
        """The twin that is shown; raises InputError before an identification."""
        return self.require_outcome().twin

    def _get_detected_shift(self, index: int) -> Shift:
        found = self.require_opened().found
        if found is None or not 0 <= index < len(found.shifts):
            raise InputError("there is no such shift", "choose one of the shifts of the log")
        return found.shifts[index]
