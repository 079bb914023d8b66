# SPDX-License-Identifier: MIT
"""Events of a fleet run in order of time, for people and machines."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from typing import Any, ClassVar

from drivetwin.fleet.task import State


@dataclass(frozen=True)
class Started:
    """Start of a run: number of files, store folder, dashboard address."""

    event: ClassVar[str] = "started"
    files: int
    store: str
    dashboard: str | None


@dataclass(frozen=True)
class Settled:
    """Outcome of a file. `computed` is True if this run computed it."""

    event: ClassVar[str] = "log"
    path: str
    log: str
    unit: str
    state: State
    computed: bool
    seconds: float = 0.0
    error: str = ""
    what: str = ""


@dataclass(frozen=True)
class Retried:
    """A worker was lost with a log at work; it is tried again after `wait` [s]."""

    event: ClassVar[str] = "retry"
    log: str
    reason: str
    wait: float


@dataclass(frozen=True)
class Noted:
    """Something about the run itself, such as a scheduler that went away."""

    event: ClassVar[str] = "note"
    text: str


@dataclass(frozen=True)
class Summary:
    """The end of a run: files by state, those that needed no work, failures by reason.

    `complete` is False where the run was interrupted; the same command then goes on.
    """

    event: ClassVar[str] = "summary"
    files: int
    done: int
    bad: int
    quarantined: int
    skipped: int
    computed: int
    seconds: float
    complete: bool
    failures: dict[str, int] = field(default_factory=dict)


Event = Started | Settled | Retried | Noted | Summary
Listener = Callable[[Event], None]


def to_document(event: Event) -> dict[str, Any]:
    """For a line of JSON."""
    return {"event": event.event, **asdict(event)}
