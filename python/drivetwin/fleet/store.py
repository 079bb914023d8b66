# SPDX-License-Identifier: MIT
"""A store of a fleet: the index, the parts, and who may write to them."""

from __future__ import annotations

import platform
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from drivetwin._util.optional_dependencies import import_extra
from drivetwin.errors import StoreError, Where
from drivetwin.fleet import parts
from drivetwin.fleet.index import INDEX, RUN_COLUMNS, Index
from drivetwin.fleet.rows import RowKind
from drivetwin.fleet.task import GO_ON, Outcome, State, Task

_LOCK = "coordinator.lock"
REPORTS, TRACES = "reports", "traces"


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
        for folder in (parts.INBOX, REPORTS, TRACES):
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

    def get_traces_path(self, log: str) -> Path:
        """Return the path of a single log's traces."""
        return self.folder / TRACES / f"{log}.parquet"

    def has_missing_files(self, task: Task) -> bool:
        """Return True if a requested report or trace file is missing."""
        return any(
            one is not None and not Path(one).is_file() for one in (task.report, task.traces)
        )

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

        from drivetwin.fleet.rows import make_schema

        tables = [parts.read_rows(path, kinds) for path in self.list_parts()]
        whole = pa.concat_tables([make_schema().empty_table(), *tables])
        return whole.take(pc.sort_indices(whole.column("log")))

    def read_table(self, name: str) -> list[dict[str, Any]]:
        """Read the rows of an index table by its key, without the columns on runs."""
        columns = [column for column in self.index.list_columns(name) if column not in RUN_COLUMNS]
        listed = ", ".join(f'"{column}"' for column in columns)
        rows = self.index.select(f"SELECT {listed} FROM {name} ORDER BY 1, 2")
        return [dict(zip(columns, row, strict=True)) for row in rows]

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
