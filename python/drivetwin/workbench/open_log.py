# SPDX-License-Identifier: MIT
"""One log of a session: file, mapping, contents, phases set by hand, shifts held out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import InputError
from drivetwin.shifts.shift import Shift
from drivetwin.vehicle.card import VehicleCard
from drivetwin.workbench.mapping import Corrections
from drivetwin.workbench.phases import Boundary, move_boundaries
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
    shift. `held` are the indices of the shifts that are predicted instead of fitted.
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
