# SPDX-License-Identifier: MIT
"""SQL over a store by DuckDB: the Parquet parts, and the index beside them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

from drivetwin._util.csv_text import format_csv_row
from drivetwin._util.optional_dependencies import import_extra
from drivetwin.errors import InputError, QueryError, Where
from drivetwin.fleet.index import ONE_FILE_EACH, Index
from drivetwin.fleet.readings import to_datetime
from drivetwin.fleet.rows import RowKind, make_schema
from drivetwin.fleet.rules import FILE_COLUMNS, is_date
from drivetwin.fleet.store import Store

_VIEWS = (RowKind.PARAMETER, RowKind.FRICTION, RowKind.FIT, RowKind.QUALITY, RowKind.WARNING)
_TABLES = ("logs", "shifts", "settings")
_PLACED = "placed"
"""The file that stands for each log, as a table: `files` has all of them."""


@dataclass(frozen=True)
class Answer:
    """Columns and rows of a query."""

    columns: Sequence[str]
    rows: Sequence[tuple[Any, ...]]


def query_store(store: Store, sql: str) -> Answer:
    """Answer a question in SQL. The tables are

    `rows`, all numbers of all logs; `files`, with a column for each field; `logs`, `shifts` and
    `settings` of the index; and, with path, unit and fields of one file of the log beside each
    row, `parameters`, `frictions`, `fits`, `qualities` and `warnings`. Raises QueryError for a
    question that DuckDB does not take, that would write or that names other files,
    MissingExtraError without DuckDB.
    """
    duckdb = import_extra("duckdb", "query", "a query", store.folder)
    with duckdb.connect(config={"autoinstall_known_extensions": "false"}) as database:
        _make_tables(database, store)
        _close_outside(database, store)
        try:
            _refuse_changes(duckdb, sql)
            database.execute(sql)
            columns = [column[0] for column in database.description or ()]
            return Answer(columns, database.fetchall() if columns else ())
        except duckdb.Error as fault:
            raise QueryError(
                f"the database does not take this: {fault}",
                "try 'SELECT * FROM parameters LIMIT 5'; docs/howto/fleet.md lists the tables",
            ) from None


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
