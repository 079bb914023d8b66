# SPDX-License-Identifier: MIT
"""SQL over a store by DuckDB: the Parquet parts, and the index beside them."""

from __future__ import annotations

import json
import sys
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from drivetwin._util.optional_dependencies import import_extra
from drivetwin._util.text import format_csv_row
from drivetwin.errors import InputError, QueryError, Where
from drivetwin.fleet.rules import FILE_COLUMNS, is_date, to_datetime
from drivetwin.fleet.store import ONE_FILE_EACH, Index, Store
from drivetwin.fleet.task import Limits, RowKind, make_schema

_VIEWS = (RowKind.PARAMETER, RowKind.FRICTION, RowKind.FIT, RowKind.QUALITY, RowKind.WARNING)
_TABLES = ("logs", "shifts", "settings")
_PLACED = "placed"
"""The file that stands for each log, as a table: `files` has all of them."""


@dataclass(frozen=True)
class Answer:
    """Columns and rows of a query."""

    columns: Sequence[str]
    rows: Sequence[tuple[Any, ...]]


QUERY_LIMITS = Limits(seconds=60.0, memory=2 * 2**30)
"""Limits of a query: a question to 10,000 logs takes seconds."""
_CHUNK = 10_000
"""Rows that are fetched at once, between two checks of the limits."""


def query_store(store: Store, sql: str, limits: Limits = QUERY_LIMITS) -> Answer:
    """Answer a question in SQL. The tables are

    `rows`, all numbers of all logs; `files`, with a column for each field; `logs`, `shifts` and
    `settings` of the index; and, with path, unit and fields of one file of the log beside each
    row, `parameters`, `frictions`, `fits`, `qualities` and `warnings`. Raises QueryError for a
    question that DuckDB does not take, that would write, that names other files or that exceeds
    the `limits`, MissingExtraError without DuckDB. The limit of the memory applies to the database
    and to the answer, each by itself.
    """
    duckdb = import_extra("duckdb", "query", "a query", store.folder)
    config = {
        "autoinstall_known_extensions": "false",
        "memory_limit": f"{limits.memory}B",
        "temp_directory": "",  # nothing is moved to the disk instead
    }
    with duckdb.connect(config=config) as database:
        try:
            _make_tables(database, store)
            _close_outside(database, store)
            _refuse_changes(duckdb, sql)
            with _interrupt_after(limits.seconds, database):
                return _fetch_answer(database, sql, limits)
        except duckdb.InterruptException:
            raise _refuse_long(limits) from None
        except duckdb.OutOfMemoryException:
            raise _refuse_large(limits) from None
        except duckdb.Error as fault:
            raise QueryError(
                f"the database does not take this: {fault}",
                "try 'SELECT * FROM parameters LIMIT 5'; docs/howto/fleet.md lists the tables",
            ) from None


@contextmanager
def _interrupt_after(seconds: float, database: Any) -> Iterator[None]:
    """Interrupt the database if the block takes longer."""
    timer = threading.Timer(seconds, database.interrupt)
    timer.daemon = True
    timer.start()
    try:
        yield
    finally:
        timer.cancel()


def _fetch_answer(database: Any, sql: str, limits: Limits) -> Answer:
    """Execute a question and fetch its rows within the limits; raises QueryError beyond them."""
    end = time.monotonic() + limits.seconds
    database.execute(sql)
    columns = [column[0] for column in database.description or ()]
    rows: list[tuple[Any, ...]] = []
    room = limits.memory
    while columns and (some := database.fetchmany(_CHUNK)):
        rows += some
        room -= _measure(some)
        if room < 0:
            raise _refuse_large(limits)
        if time.monotonic() > end:
            raise _refuse_long(limits)
    return Answer(columns, rows)


def _measure(value: Any) -> int:
    """Measure the memory [bytes] of a value with all that it contains."""
    size = sys.getsizeof(value)
    if isinstance(value, dict):
        value = [*value, *value.values()]
    return size + sum(map(_measure, value)) if isinstance(value, list | tuple) else size


def _refuse_long(limits: Limits) -> QueryError:
    return QueryError(
        f"the query was stopped after its time limit of {limits.seconds:g} s",
        f"{_ASK_LESS} or raise the time limit (--time-limit)",
    )


def _refuse_large(limits: Limits) -> QueryError:
    return QueryError(
        f"the query needs more than its memory limit of {limits.memory / 2**20:g} MiB",
        f"{_ASK_LESS} or raise the memory limit (--memory-limit)",
    )


_ASK_LESS = "select fewer rows (WHERE, LIMIT), aggregate them (GROUP BY),"


def _close_outside(database: Any, store: Store) -> None:
    """Let the database read the parts of the store and no other file."""
    allowed = ", ".join("'" + str(path).replace("'", "''") + "'" for path in store.list_parts())
    database.execute(f"SET allowed_paths = [{allowed}]")
    database.execute("SET enable_external_access = false")
    database.execute("SET lock_configuration = true")


def _refuse_changes(duckdb: Any, sql: str) -> None:
    """Raise QueryError for statements that do more than answer, such as COPY and ATTACH."""
    for statement in duckdb.extract_statements(sql):
        if statement.type not in (duckdb.StatementType.SELECT, duckdb.StatementType.EXPLAIN):
            raise QueryError(
                f"a query may only read: this is {statement.type.name}",
                "ask with SELECT; '-o FILE' writes the answer",
            )


def _make_tables(database: Any, store: Store) -> None:
    import pyarrow as pa

    names = [str(path) for path in store.list_parts()]
    if names:
        database.from_parquet(names).create_view("rows")
    else:
        database.register("rows", make_schema().empty_table())
    for table in _TABLES:
        database.register(table, _fetch_arrow_table(store.index, f"SELECT * FROM {table}"))
    for name, condition in (("files", "1"), (_PLACED, ONE_FILE_EACH)):
        files = _list_files(store.index, condition)
        database.register(
            name, pa.Table.from_pylist(files) if files else _fetch_arrow_table(store.index, _NO)
        )
    for kind in _VIEWS:
        plural = {"quality": "qualities"}.get(kind.value, f"{kind.value}s")
        database.execute(
            f"CREATE VIEW {plural} AS SELECT {_PLACED}.* EXCLUDE (log), rows.* EXCLUDE (kind) "
            f"FROM rows JOIN {_PLACED} USING (log) WHERE kind = '{kind.value}'"
        )


_FILES = f"SELECT {', '.join(FILE_COLUMNS)}"
_NO = f"{_FILES} FROM files WHERE 0"


def _fetch_arrow_table(index: Index, sql: str) -> Any:
    """Arrow table of a query of the index."""
    import pyarrow as pa

    names, rows = index.fetch_table(sql)
    return pa.table({name: [row[k] for row in rows] for k, name in enumerate(names)})


def _list_files(index: Index, condition: str) -> list[dict[str, Any]]:
    """One row for each file of which the condition holds, with its fields as columns; a field may
    be absent.
    """
    sql = f"{_FILES}, fields FROM files WHERE {condition} ORDER BY path"
    found = [
        {**dict(zip(FILE_COLUMNS, known, strict=True)), **_convert_fields(fields)}
        for *known, fields in index.select(sql)
    ]
    columns = dict.fromkeys(name for row in found for name in row)
    return [{name: row.get(name) for name in columns} for row in found]


def _convert_fields(fields: str) -> dict[str, float | datetime]:
    """Fields by name; a date as a point in time (UTC), with which SQL can reckon."""
    return {
        name: to_datetime(reading).replace(tzinfo=None) if is_date(name) else reading
        for name, reading in json.loads(fields).items()
    }


def save_answer(answer: Answer, path: Path, store: Path) -> None:
    """Write an answer as CSV, or as Parquet for a name that ends in `.parquet`.

    Raises InputError for a path inside the store.
    """
    from io import BytesIO

    from drivetwin._util.atomic import write_bytes, write_text

    if path.resolve().is_relative_to(store.resolve()):
        what = "an answer is not written into the store that it was taken from"
        raise InputError(what, "name a file outside the store", Where(file=str(path)))
    if path.suffix.casefold() == ".parquet":
        import pyarrow as pa
        import pyarrow.parquet as pq

        table = pa.table({n: [row[k] for row in answer.rows] for k, n in enumerate(answer.columns)})
        buffer = BytesIO()
        pq.write_table(table, buffer)
        write_bytes(path, buffer.getvalue())
        return
    write_text(path, "".join(map(format_csv_row, (answer.columns, *answer.rows))))
