# SPDX-License-Identifier: MIT
"""Requests, replies and events of a run, and the rows that a log leaves."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from enum import StrEnum
from functools import cache
from typing import Any, ClassVar

from drivetwin.estimation.result.estimate import Estimate
from drivetwin.estimation.result.method import Method


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


GO_ON = (
    "make room or give write permission, then run the same command again: finished logs are kept"
)
"""Remedy for the user if a store cannot be written."""


class State(StrEnum):
    """State of a log. The last three are final for its content and settings."""

    WAITING = "waiting"
    DONE = "done"
    BAD = "bad"
    """The log itself cannot be used; trying again would end the same way."""
    QUARANTINED = "quarantined"
    """It hung, ate memory, killed its worker again and again, or its drive failed."""


@dataclass(frozen=True)
class TaskSpec:
    """Everything but the log's content that decides its rows; equal recipes give equal rows.

    `vehicle` and `channels` are absolute paths, `inputs` the SHA-256 of these files and of the DBC
    files behind them, `means` channels by field name whose mean the rows hold, `mu_slip` [rad/s]
    where friction is compared.
    """

    vehicle: str
    channels: str | None
    method: Method
    quick: bool
    inputs: tuple[tuple[str, str], ...]
    version: str
    means: tuple[tuple[str, str], ...] = ()
    mu_slip: float = 50.0


Member = tuple[str, str]
"""Path and SHA-256 of a log of a vehicle."""


@dataclass(frozen=True)
class Task:
    """One log to identify. `log` is the key of its rows, `content` the SHA-256 of the file.

    `members` are path and SHA-256 of all bus logs of one vehicle, which are identified together;
    empty for a log that is identified alone. The first one is at `path`.

    `part` is the Parquet file to write, `report` the HTML page that is wanted besides; both are
    absolute paths.
    """

    log: str
    path: str
    content: str
    recipe: TaskSpec
    part: str
    report: str | None = None
    members: tuple[Member, ...] = ()

    def to_json(self) -> str:
        """One line of JSON."""
        return json.dumps(asdict(self))

    @classmethod
    def from_json(cls, text: str) -> Task:
        """Back from `to_json`."""
        tree = json.loads(text)
        recipe = tree["recipe"]
        recipe |= {name: tuple(map(tuple, recipe[name])) for name in ("inputs", "means")}
        recipe |= {"method": Method(recipe["method"])}
        members = tuple(map(tuple, tree["members"]))
        return cls(**{**tree, "recipe": TaskSpec(**recipe), "members": members})


@dataclass(frozen=True)
class ShiftRow:
    """One shift of a log, used or refused; times on the log's clock [s]."""

    used: bool
    start: float
    end: float
    start_gear: str = ""
    end_gear: str = ""
    kind: str = ""
    offgoing: str = ""
    oncoming: str = ""
    reason: str = ""


@dataclass(frozen=True)
class Outcome:
    """Final result of a log; it is reproducible with the same recipe.

    `error`, `what` and `remedy` are those of the typed error of a log that is not done.
    """

    state: State
    shifts: tuple[ShiftRow, ...] = ()
    error: str = ""
    what: str = ""
    remedy: str = ""

    def to_tree(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)

    @classmethod
    def from_tree(cls, tree: Mapping[str, Any]) -> Outcome:
        """Back from `tree`."""
        shifts = tuple(ShiftRow(**row) for row in tree["shifts"])
        return cls(**{**tree, "state": State(tree["state"]), "shifts": shifts})


@dataclass(frozen=True)
class Completed:
    """Reply of a worker: the outcome and the computing time [s]."""

    outcome: Outcome
    seconds: float


@dataclass(frozen=True)
class WorkerLost:
    """The worker went away before it answered; the log may or may not be to blame.

    `blame`: whether the loss counts against the log, as that of its own worker does; the loss of
    a scheduler does not.
    """

    reason: str
    blame: bool = True


@dataclass(frozen=True)
class Aborted:
    """Nothing can go on, by no fault of the log: no worker starts, or none can write its part."""

    what: str
    remedy: str


Reply = Completed | WorkerLost | Aborted


@dataclass(frozen=True)
class Limits:
    """Time [s] and memory [bytes] that the worker of one log may use."""

    seconds: float = 600.0
    memory: int = 4 * 2**30


IDENTIFY = "drivetwin.fleet.identify:identify_log"
"""Function of a worker."""


@dataclass(frozen=True)
class WorkerSpec:
    """Specification of a worker: its function as `module:name`, and the limits of one log."""

    function: str = IDENTIFY
    limits: Limits = field(default_factory=Limits)


def make_memory_outcome(memory: int) -> Outcome:
    """The outcome of a log whose worker needed more than so many bytes."""
    return Outcome(
        State.QUARANTINED,
        error="MemoryLimit",
        what=f"it needed more than {memory / 2**20:g} MiB of memory",
        remedy="look at the log with 'drivetwin inspect'; "
        "run again with --retry and a larger --memory-limit if it is only long",
    )


MU = "mu."
"""Id of the friction coefficient at the recipe's reference slip, before the element's name."""


class RowKind(StrEnum):
    """Kind of a row, which also determines the meaning of its `name`."""

    PARAMETER = "parameter"
    """Parameter id; `mu.<element>` is μ at slip `at`."""
    FRICTION = "friction"
    """Element; μ at slip `at`."""
    FIT = "fit"
    """`<signal>.<phase>.rmse` or `.fit_percent` of simulation over measurement."""
    QUALITY = "quality"
    """Quality figure of shift number `shift`."""
    FIELD = "field"
    """Mean of a channel that the rules made a field."""
    WARNING = "warning"
    """Code of a finding, empty for other remarks; the text is the `reason`."""


@dataclass(frozen=True)
class Row:
    """One number of a log, SI; `at` is a slip [rad/s].

    `free_value`, `free_std` are the estimate from the log alone if the value also depends on a
    design value of the card.
    """

    kind: RowKind
    name: str
    value: float | None = None
    std_noise: float | None = None
    std_total: float | None = None
    ci95_lo: float | None = None
    ci95_hi: float | None = None
    si_unit: str = ""
    verdict: str = ""
    method: str = ""
    reason: str = ""
    shift: int | None = None
    at: float | None = None
    free_value: float | None = None
    free_std: float | None = None


def make_estimate_row(one: Estimate) -> Row:
    """Return the row of an estimate."""
    low, high = one.ci95_total or (None, None)
    return Row(
        RowKind.PARAMETER, one.id, one.value, one.std_noise, one.std_total, low, high,
        one.unit, one.verdict.value, one.method, one.reason,
    )  # fmt: skip


ROW_COLUMNS = ("log", *(field.name for field in fields(Row)))
"""Columns of a part: the key of the log's row in the index, then those of a Row."""


@dataclass(frozen=True)
class Found:
    """Result of identifying a log: its rows and its shifts."""

    rows: Sequence[Row]
    shifts: Sequence[ShiftRow]


@cache
def make_schema() -> Any:
    """Arrow schema of all parts; `log` is the key of the log's row in the index."""
    import pyarrow as pa

    texts = ("si_unit", "verdict", "method", "reason")
    numbers = ("value", "std_noise", "std_total", "ci95_lo", "ci95_hi")
    return pa.schema(
        [
            ("log", pa.string()),
            ("kind", pa.string()),
            ("name", pa.string()),
            *((name, pa.float64()) for name in numbers),
            *((name, pa.string()) for name in texts),
            ("shift", pa.int16()),
            ("at", pa.float64()),
            ("free_value", pa.float64()),
            ("free_std", pa.float64()),
        ]
    )


def make_arrow_table(log: str, rows: Sequence[Row]) -> Any:
    """Arrow table of a log's rows, in their order."""
    import pyarrow as pa

    columns = {name: [getattr(row, name) for row in rows] for name in make_schema().names[1:]}
    return pa.table({"log": [log] * len(rows), **columns}, schema=make_schema())
