# SPDX-License-Identifier: MIT
"""A store of a fleet: the index, the parts, and who may write to them."""

from __future__ import annotations

import json
import platform
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from drivetwin._util.optional_dependencies import import_extra
from drivetwin.errors import StoreError, Where
from drivetwin.fleet import parts
from drivetwin.fleet.task import GO_ON, Outcome, RowKind, ShiftRow, State, Task

INDEX = "index.sqlite"
_FORMAT = 1
_ANEW = "remove the file and run the same command again: all logs are then done anew"
_AFTER_HEX = "g"
"""Sorts behind every key that goes on with a hexadecimal digit."""
_SCHEMA = """
CREATE TABLE settings (
    settings TEXT PRIMARY KEY, version TEXT NOT NULL, document TEXT NOT NULL
) WITHOUT ROWID;
CREATE TABLE logs (
    log TEXT PRIMARY KEY, content TEXT NOT NULL, settings TEXT NOT NULL, version TEXT NOT NULL,
    state TEXT NOT NULL, error TEXT NOT NULL DEFAULT '', what TEXT NOT NULL DEFAULT '',
    remedy TEXT NOT NULL DEFAULT '', part TEXT NOT NULL DEFAULT '',
    attempts INTEGER NOT NULL DEFAULT 0, seconds REAL
) WITHOUT ROWID;
CREATE TABLE shifts (
    log TEXT NOT NULL, shift INTEGER NOT NULL, content TEXT NOT NULL, settings TEXT NOT NULL,
    version TEXT NOT NULL, state TEXT NOT NULL, reason TEXT NOT NULL, begin REAL, "end" REAL,
    start_gear TEXT, end_gear TEXT, kind TEXT, offgoing TEXT, oncoming TEXT,
    PRIMARY KEY (log, shift)
) WITHOUT ROWID;
CREATE TABLE files (
    path TEXT PRIMARY KEY, log TEXT NOT NULL, content TEXT NOT NULL, size INTEGER NOT NULL,
    modified INTEGER NOT NULL, rule TEXT NOT NULL, unit TEXT NOT NULL, fields TEXT NOT NULL,
    run INTEGER NOT NULL
) WITHOUT ROWID;
CREATE INDEX files_of_log ON files (log);
"""
"""`logs.state` is a State; that of a shift is `used` or `refused`. `logs.part` is the large part
that holds a log's rows, empty while it has one of its own. `files.log` is the log that a file was
when it was last looked at; `files.run` counts the calls of `fleet`.
"""

ONE_FILE_EACH = (
    "NOT EXISTS (SELECT 1 FROM files AS other WHERE other.log = files.log AND (other.run > "
    "files.run OR (other.run = files.run AND other.path < files.path)))"
)
"""SQL condition that selects one file of each log: the first path of the last run. The index keeps
the old path of a moved file, and a log stored at two places counts once.
"""


@dataclass(frozen=True)
class FileRow:
    """Log file at its last scan: size [bytes], modification time [ns], unit and log key."""

    path: str
    log: str
    content: str
    size: int
    modified: int
    rule: str
    unit: str
    fields: Mapping[str, float]


class Index:
    """The index, open for one coordinator or for readers; see the module's text."""

    def __init__(self, path: Path, *, write: bool) -> None:
        self._path = path
        mode = "rwc" if write else "ro"
        with self._convert_errors():
            uri = f"{path.absolute().as_uri()}?mode={mode}"
            self._db = sqlite3.connect(uri, uri=True, timeout=30.0, isolation_level=None)
            if write:
                self._prepare()
            self._check_format()
        self.run = self._fetch_value("SELECT coalesce(max(run), 0) FROM files") + 1

    def _prepare(self) -> None:
        self._db.execute("PRAGMA journal_mode = DELETE")
        self._db.execute("PRAGMA synchronous = FULL")
        if not self._fetch_value("SELECT count(*) FROM sqlite_schema"):
            self._db.executescript(f"BEGIN; {_SCHEMA} PRAGMA user_version = {_FORMAT}; COMMIT;")

    def _check_format(self) -> None:
        version = self._fetch_value("PRAGMA user_version")
        if version != _FORMAT:
            raise StoreError(
                f"the index has format {version}, this program reads {_FORMAT}",
                "give another folder, or use the program's version that made the store",
                Where(file=str(self._path)),
            )

    def close(self) -> None:
        """Commit and close."""
        with self._convert_errors():
            try:
                self.commit()
            finally:
                self._db.close()

    def commit(self) -> None:
        """Commit all writes."""
        with self._convert_errors():
            if self._db.in_transaction:
                self._db.execute("COMMIT")

    def select(self, sql: str, *values: object) -> Iterator[tuple[Any, ...]]:
        """Rows of a query."""
        with self._convert_errors():
            yield from self._db.execute(sql, values)

    def fetch_table(self, sql: str) -> tuple[list[str], list[tuple[Any, ...]]]:
        """Names of the columns, and all rows, of a query."""
        with self._convert_errors():
            cursor = self._db.execute(sql)
            return [column[0] for column in cursor.description], cursor.fetchall()

    def get_file(self, path: str) -> FileRow | None:
        """The file as last seen, None for a new one."""
        sql = "SELECT path, log, content, size, modified, rule, unit, fields FROM files"
        for *known, text in self.select(f"{sql} WHERE path = ?", path):
            place, log, content, size, modified, rule, unit = known
            return FileRow(place, log, content, size, modified, rule, unit, json.loads(text))
        return None

    def has_file_from_this_run(self, path: str) -> bool:
        """Return True if `set_file` was called for the path since this index was opened."""
        return bool(
            self._fetch_value(
                "SELECT count(*) FROM files WHERE path = ? AND run = ?", path, self.run
            )
        )

    def set_file(self, file: FileRow) -> None:
        """Store a file; replace the earlier entry of its path."""
        fields = json.dumps(dict(file.fields))
        values = (file.path, file.log, file.content, file.size, file.modified, file.rule, file.unit)
        self._write(
            "INSERT OR REPLACE INTO files VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
            [(*values, fields, self.run)],
        )

    def get_state(self, log: str) -> State | None:
        """Return the state of a log; None if the log is not in the index."""
        for (state,) in self.select("SELECT state FROM logs WHERE log = ?", log):
            return State(state)
        return None

    def get_outcome(self, log: str) -> Outcome:
        """Return the outcome of a log, without its shifts."""
        (row,) = self.select("SELECT state, error, what, remedy FROM logs WHERE log = ?", log)
        return Outcome(State(row[0]), (), *row[1:])

    def set_settings(self, settings: str, version: str, document: str) -> None:
        """Store the settings of a hash."""
        row = (settings, version, document)
        self._write("INSERT OR IGNORE INTO settings VALUES (?, ?, ?)", [row])

    def add_waiting_log(self, log: str, content: str, settings: str, version: str) -> None:
        """Add a log in the waiting state; an existing log is unchanged."""
        sql = "INSERT OR IGNORE INTO logs (log, content, settings, version, state)"
        values = (log, content, settings, version, State.WAITING.value)
        self._write(f"{sql} VALUES (?, ?, ?, ?, ?)", [values])

    def set_attempts(self, log: str, attempts: int) -> None:
        """Store the number of attempts of a log."""
        self._write("UPDATE logs SET attempts = ? WHERE log = ?", [(attempts, log)])

    def set_outcome(self, log: str, outcome: Outcome, seconds: float) -> None:
        """Store the outcome of a log, and its shifts."""
        self._write(
            "UPDATE logs SET state = ?, error = ?, what = ?, remedy = ?, seconds = ? WHERE log = ?",
            [(outcome.state, outcome.error, outcome.what, outcome.remedy, seconds, log)],
        )
        self._write("DELETE FROM shifts WHERE log = ?", [(log,)])
        self._write(
            "INSERT INTO shifts SELECT log, ?, content, settings, version, "
            "?, ?, ?, ?, ?, ?, ?, ?, ? FROM logs WHERE log = ?",
            [(number, *_make_shift_values(row), log) for number, row in enumerate(outcome.shifts)],
        )

    def reset(self, logs: Iterable[str]) -> None:
        """Reset logs to the waiting state."""
        sql = "UPDATE logs SET state = ?, error = '', what = '', remedy = '', part = ''"
        values = [(State.WAITING.value, log) for log in logs]
        self._write(f"{sql} WHERE log = ?", values)

    def iterate_done_logs(self, prefix: str = "") -> Iterator[tuple[str, str]]:
        """Iterate over key and large part of the done logs whose keys have the prefix, by key."""
        sql = "SELECT log, part FROM logs WHERE state = ? AND log >= ? AND log < ? ORDER BY log"
        yield from self.select(sql, State.DONE.value, prefix, prefix + _AFTER_HEX)

    def set_part(self, prefix: str, part: str) -> None:
        """Assign `part` to all done logs whose keys have the prefix."""
        sql = "UPDATE logs SET part = ? WHERE state = ? AND log >= ? AND log < ?"
        self._write(sql, [(part, State.DONE.value, prefix, prefix + _AFTER_HEX)])

    def list_large_parts(self) -> set[str]:
        """Names of the large parts."""
        return {part for (part,) in self.select("SELECT DISTINCT part FROM logs WHERE part != ''")}

    def count(self, state: State) -> int:
        """Count the logs in a state."""
        return int(self._fetch_value("SELECT count(*) FROM logs WHERE state = ?", state.value))

    def _write(self, sql: str, values: list[tuple[Any, ...]]) -> None:
        with self._convert_errors():
            if not self._db.in_transaction:
                self._db.execute("BEGIN IMMEDIATE")
            self._db.executemany(sql, values)

    def _fetch_value(self, sql: str, *values: object) -> Any:
        (row,) = self.select(sql, *values)
        return row[0]

    @contextmanager
    def _convert_errors(self) -> Iterator[None]:
        """Convert SQLite errors to StoreError."""
        try:
            yield
        except sqlite3.Error as fault:
            text = str(fault)
            if "readonly" in text or "full" in text:
                text, remedy = f"the store cannot be written: {text}", GO_ON
            elif "malformed" in text:
                text, remedy = f"the index is damaged: {text}", _ANEW
            else:
                text = f"the index cannot be used: {text}"
                remedy = "check its permissions and that it is an index of drivetwin"
            raise StoreError(text, remedy, Where(file=str(self._path))) from None


def _make_shift_values(row: ShiftRow) -> tuple[object, ...]:
    state = "used" if row.used else "refused"
    gears = (row.start_gear, row.end_gear, row.kind, row.offgoing, row.oncoming)
    return (state, row.reason, row.start, row.end, *gears)


_LOCK = "coordinator.lock"
REPORTS = "reports"


class Store:
    """A store, open for the one coordinator (`write`) or for any number of readers.

    Raises StoreError where it is in use, not writable, no store, or of a newer format, and
    MissingExtraError without pyarrow.
    """

    def __init__(self, folder: Path, *, write: bool = False) -> None:
        import_extra("pyarrow", "fleet", "a fleet's store", folder)
        self.folder = folder.absolute()
        self._lock: sqlite3.Connection | None = None
        if write:
            self._acquire_lock()
        elif not (folder / INDEX).is_file():
            raise StoreError(
                "this is no store of a fleet", "make one with 'drivetwin fleet LOGS -o STORE'",
                Where(file=str(folder)),
            )  # fmt: skip
        try:
            self.index = Index(self.folder / INDEX, write=write)
            if write:
                self._reset_incomplete()
        except BaseException:
            self._release_lock()
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        fault: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        try:
            if self._lock is not None:
                with suppress(OSError):  # what remains is deleted when the store is opened again
                    self._delete_unfinished()
            self.index.close()
        finally:
            self._release_lock()

    def _release_lock(self) -> None:
        if self._lock is not None:
            self._lock.close()

    def _acquire_lock(self) -> None:
        """Become the only writer. The lock is SQLite's: it ends with the process, however it ends,
        and holds on whatever file system the index itself is safe on.
        """
        place = Where(file=str(self.folder))
        try:
            for name in (parts.INBOX, parts.ROWS):
                (self.folder / name).mkdir(parents=True, exist_ok=True)
            self._lock = sqlite3.connect(self.folder / _LOCK, timeout=0.0, isolation_level=None)
            self._lock.execute("BEGIN EXCLUSIVE")
        except OSError as fault:
            what = f"the store cannot be written: {fault.strerror}"
            raise StoreError(what, "check its permissions and the free space", place) from None
        except sqlite3.Error as fault:
            if "locked" in str(fault):
                raise StoreError(
                    "another 'drivetwin fleet' is writing this store",
                    "wait until it is through, or give another -o",
                    place,
                ) from None
            what = f"the store cannot be written: {fault}"
            raise StoreError(what, "check its permissions and the free space", place) from None

    def _reset_incomplete(self) -> None:
        """Reset the logs whose rows are missing to waiting, and delete unfinished files."""
        for part in self.index.list_large_parts():
            if (self.folder / part).is_file():
                parts.check_footer(self.folder / part)
            else:
                logs = self.index.select("SELECT log FROM logs WHERE part = ?", part)
                self.index.reset([log for (log,) in logs])
        single = [log for log, part in self.index.iterate_done_logs() if not part]
        self.index.reset([log for log in single if not self.get_part_path(log).is_file()])
        self.index.commit()
        self._drop_rows()
        self._delete_unfinished()

    def _delete_unfinished(self) -> None:
        """Delete the half-written files of workers that were killed."""
        for folder in (parts.INBOX, REPORTS):
            for leftover in (self.folder / folder).rglob("*.partial"):
                leftover.unlink(missing_ok=True)

    def _drop_rows(self) -> None:
        """Remove large parts that the index does not name."""
        known = self.index.list_large_parts()
        for file in (self.folder / parts.ROWS).iterdir():
            if f"{parts.ROWS}/{file.name}" not in known:
                file.unlink()

    def get_part_path(self, log: str) -> Path:
        """Return the path of a log's own part."""
        return self.folder / parts.get_part_name(log)

    def get_report_path(self, log: str) -> Path:
        """Return the path of a single log's report."""
        return self.folder / REPORTS / f"{log}.html"

    def is_report_missing(self, task: Task) -> bool:
        """Return True if a report is wanted and missing."""
        return task.report is not None and not Path(task.report).is_file()

    def read_part_outcome(self, log: str) -> Outcome | None:
        """Read the outcome written by a worker, which may not be in the index yet."""
        return parts.read_outcome(self.get_part_path(log))

    def compact(self) -> None:
        """Bring the parts of single logs together into a few large ones.

        What they are depends on the logs that are done, not on the order in which they came. The
        old parts go when the index has the new ones, so that no row is ever missing or double.
        """
        with self._convert_disk_errors():
            self.index.commit()
            for prefix in parts.make_prefixes(self.index.count(State.DONE)):
                if held := dict(self.index.iterate_done_logs(prefix)):
                    files = {self._locate_rows(log, part) for log, part in held.items()}
                    name = parts.merge_parts(self.folder, prefix, list(held), sorted(files))
                    self.index.set_part(prefix, name)
            self.index.commit()
            self._drop_rows()
            for file in (self.folder / parts.INBOX).glob("*/*.parquet"):
                if self.index.get_state(file.stem) is not State.WAITING:
                    file.unlink()

    def _locate_rows(self, log: str, part: str) -> Path:
        """The file with a log's rows."""
        return self.folder / part if part else self.get_part_path(log)

    def list_parts(self) -> list[Path]:
        """The files that hold all rows of logs that are done, each row once."""
        return sorted(
            {self._locate_rows(log, part) for log, part in self.index.iterate_done_logs()}
        )

    def read_rows(self, *kinds: RowKind) -> Any:
        """Arrow table of the rows of logs that are done, sorted by log; of these kinds, or all."""
        import pyarrow as pa
        import pyarrow.compute as pc

        from drivetwin.fleet.task import make_schema

        tables = [parts.read_rows(path, kinds) for path in self.list_parts()]
        whole = pa.concat_tables([make_schema().empty_table(), *tables])
        return whole.take(pc.sort_indices(whole.column("log")))

    @contextmanager
    def _convert_disk_errors(self) -> Iterator[None]:
        """Convert errors of a full or read-only disk to StoreError."""
        try:
            yield
        except OSError as fault:
            raise StoreError(
                f"the store cannot be written: {fault.strerror} (on {platform.node()})",
                GO_ON,
                Where(file=str(self.folder)),
            ) from None
