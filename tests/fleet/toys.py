# SPDX-License-Identifier: MIT
"""A fleet of tiny files for `tests/fleet/work.py`, and how a test runs it.

As `python -m tests.fleet.toys LOGS STORE [SCHEDULER]` it is a coordinator that a test can kill.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from drivetwin import Method
from drivetwin._util.atomic import interrupt_on_signals
from drivetwin.fleet import parts, scan, task
from drivetwin.fleet.coordinator import FleetRun, run_fleet
from drivetwin.fleet.rules import Sources, read_rules
from drivetwin.fleet.store import FileRow, Store
from drivetwin.fleet.task import to_document

ROOT = Path(__file__).parents[2]


def make_logs(folder: Path, count: int, *, word: str = "", spoilt: Sequence[str] = ()) -> Path:
    """`count` files that all say `word`, the first ones a word of `spoilt` too; `card.toml`."""
    folder.mkdir()
    (folder / "card.toml").write_text("gears = 1\nelements = 1\n")
    for number in range(count):
        extra = spoilt[number] if number < len(spoilt) else ""
        unit = folder / f"unit_{number % 3}"
        unit.mkdir(exist_ok=True)
        (unit / f"log_{number:04d}.csv").write_text(f"n{number} {word} {extra}\n")
    return folder


def request(
    logs: Path, store: Path, given: Sequence[str] = (), listed: Path | None = None, **changes: Any
) -> FleetRun:
    """Request of `drivetwin fleet` with the toy at work; all of `logs` unless `given` or `listed`.

    `rules` names the rules by their file in the folder of the logs.
    """
    rules = read_rules(logs / changes.pop("rules", "card.toml"))
    sources = Sources([*given] if given or listed else [str(logs)], listed)
    settings: dict[str, Any] = {
        "function": "tests.fleet.work:toy",
        "time_limit": 30.0,
        "memory_limit": 200 * 2**20,
        "workers": 1,  # its start takes most of the time; tests of the pool ask for two
        "method": Method.PAPER,
        **changes,
    }
    return FleetRun(sources=sources, rules=rules, store=store, **settings)


def run_toys(
    logs: Path, store: Path, tell: Callable[[Any], None] | None = None, **changes: Any
) -> tuple[Any, list[Any]]:
    """Run to the end; the summary and all events."""
    events: list[Any] = []
    return run_fleet(request(logs, store, **changes), tell or events.append), events


def scan_files(rules: Path, given: Sequence[str], known: Any = None, **limits: Any) -> list[Any]:
    """Scan files as a run does."""
    made = scan.Scan(read_rules(rules), Method.PAPER, **limits)
    return list(made.scan_files(Sources([*given]), (known or {}).get))


def open_store(folder: Path) -> Any:
    """Open a store to be filled."""
    return Store(folder, write=True)


RUN_COLUMNS = frozenset({"attempts", "seconds", "modified", "run"})
"""Columns that describe the runs, not the logs; they differ between equal results."""


def read_table(store: Any, name: str) -> list[dict[str, Any]]:
    """Rows of a table of the index by its key, without the columns on runs."""
    columns, rows = store.index.fetch_table(f"SELECT * FROM {name} ORDER BY 1, 2")
    pairs = (zip(columns, row, strict=True) for row in rows)
    return [{key: one for key, one in row if key not in RUN_COLUMNS} for row in pairs]


def contents(store: Path) -> dict[str, Any]:
    """All that a store holds of its logs: every table but what tells of the runs, every row."""
    with Store(store) as opened:
        tables = {
            name: read_table(opened, name) for name in ("settings", "files", "logs", "shifts")
        }
        return {**tables, "rows": opened.read_rows().to_pylist()}


def fill(
    store: Any,
    log: str,
    found: Sequence[tuple[Any, ...]] = (),
    shifts: Sequence[tuple[Any, ...]] = (),
    **file: Any,
) -> None:
    """Add a log that is done, as a run does: rows as (kind, name, ..., by name), shifts, file."""
    made = [task.Row(task.RowKind(kind), *values, **named) for kind, *values, named in found]
    outcome = task.Outcome(task.State.DONE, tuple(task.ShiftRow(*one) for one in shifts))
    parts.write_part(store.get_part_path(log), log, outcome, made)
    store.index.add_waiting_log(log, "c", "s", "v")
    store.index.set_outcome(log, outcome, 1.0)
    if file:
        path, rule = file.get("path", log), file.get("rule", "")
        fields = file.get("fields", {})
        store.index.set_file(FileRow(path, log, "c", 1, 1, rule, file["unit"], fields))


def count_attempts(store: Path) -> dict[str, int]:
    """Return the largest number of attempts of a log, by the error of the log."""
    with Store(store) as opened:
        return dict(opened.index.select("SELECT error, max(attempts) FROM logs GROUP BY error"))


def names(events: Sequence[Any], **wanted: object) -> list[str]:
    """Names of the files that were settled with these attributes."""
    return sorted(
        Path(event.path).stem
        for event in events
        if hasattr(event, "computed")
        and hasattr(event, "path")
        and all(getattr(event, key) == value for key, value in wanted.items())
    )


def _tell(event: Any) -> None:
    print(json.dumps(to_document(event)), flush=True)


if __name__ == "__main__":
    interrupt_on_signals()
    scheduler = sys.argv[3] if len(sys.argv) > 3 else None
    asked = request(
        Path(sys.argv[1]), Path(sys.argv[2]), scheduler=scheduler, attempts=20, workers=2
    )
    run_fleet(asked, _tell)
