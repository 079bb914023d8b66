# SPDX-License-Identifier: MIT
"""Questions to a store: each log counts once, wherever its file stands."""

from __future__ import annotations

import csv
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from drivetwin.errors import InputError, QueryError
from drivetwin.fleet.query import Answer, query_store, save_answer
from drivetwin.fleet.store import Store
from drivetwin.fleet.task import Limits
from tests.fleet.toys import make_logs, run_toys


def test_a_log_that_was_moved_belongs_where_it_is_now(tmp_path: Path) -> None:
    logs = make_logs(tmp_path / "logs", 3)
    run_toys(logs, tmp_path / "store")
    (logs / "unit_0" / "log_0000.csv").rename(logs / "unit_2" / "log_0000.csv")
    run_toys(logs, tmp_path / "store")
    with Store(tmp_path / "store") as store:
        answer = query_store(store, "SELECT log, unit FROM parameters GROUP BY ALL ORDER BY unit")
        files = query_store(store, "SELECT unit FROM files ORDER BY unit")
    assert [row[1] for row in answer.rows] == ["unit_1", "unit_2", "unit_2"]
    assert len({row[0] for row in answer.rows}) == 3
    assert len(files.rows) == 4


def test_a_log_that_stands_twice_counts_once(tmp_path: Path) -> None:
    logs = make_logs(tmp_path / "logs", 2)
    (logs / "unit_1" / "copy.csv").write_bytes((logs / "unit_0" / "log_0000.csv").read_bytes())
    run_toys(logs, tmp_path / "store")
    with Store(tmp_path / "store") as store:
        rows = query_store(store, "SELECT count(*) FROM rows WHERE kind = 'parameter'").rows
        assert query_store(store, "SELECT count(*) FROM parameters").rows == rows


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Store]:
    folder = tmp_path_factory.mktemp("asked")
    run_toys(make_logs(folder / "logs", 2), folder / "store")
    (folder / "secret.csv").write_text("a,b\n1,2\n")
    with Store(folder / "store") as opened:
        yield opened


@pytest.mark.parametrize(
    "sql",
    ["COPY rows TO '{out}'", "COPY (SELECT 1) TO '{out}' (FORMAT parquet)",
     "EXPORT DATABASE '{out}'",
     "SELECT * FROM read_csv('{secret}')", "SELECT * FROM '{secret}'",
     "SELECT * FROM read_text('{secret}')", "SELECT * FROM read_blob('{secret}')",
     "SELECT * FROM glob('/etc/*')", "SELECT * FROM read_json('/etc/passwd')",
     "SELECT * FROM read_parquet('{secret}')", "ATTACH '{out}' AS x",
     "ATTACH '{out}' (TYPE sqlite)",
     "CREATE TABLE x AS SELECT 1", "DROP VIEW rows", "INSERT INTO x VALUES (1)", "DELETE FROM logs",
     "INSTALL httpfs", "LOAD httpfs", "SET enable_external_access = true", "RESET allowed_paths",
     "PRAGMA database_list", "SELECT 1; COPY rows TO '{out}'", "IMPORT DATABASE '{out}'",
     "CALL checkpoint()", "VACUUM", "SELECT * FROM sniff_csv('{secret}')",
     "SELECT * FROM read_csv('https://example.com/a.csv')", "PREPARE p AS SELECT 1"],
)  # fmt: skip
def test_a_query_only_reads(store: Store, sql: str) -> None:
    folder = store.folder.parent
    before = sorted(folder.rglob("*"))
    with pytest.raises(QueryError):
        query_store(store, sql.format(out=folder / "out", secret=folder / "secret.csv"))
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize(
    "sql",
    ["SELECT count(*) FROM rows", "WITH a AS (SELECT 1) SELECT * FROM a", "EXPLAIN SELECT 1",
     "DESCRIBE rows", "SHOW TABLES", "FROM files", "VALUES (1)"],
)  # fmt: skip
def test_questions_are_answered(store: Store, sql: str) -> None:
    assert query_store(store, sql).rows


@pytest.mark.parametrize("name", ["a.csv", "rows/a.csv", "index.sqlite", "rows/../a.parquet"])
def test_answers_stay_out_of_the_store(store: Store, name: str) -> None:
    with pytest.raises(InputError, match="into the store"):
        save_answer(Answer(["a"], [(1,)]), store.folder / name, store.folder)


def test_answers_are_safe_for_spreadsheets(store: Store, tmp_path: Path) -> None:
    answer = query_store(
        store, "SELECT '=1+1' AS \"=a\", -1.5 AS b, CAST(-2.5 AS DECIMAL(3,1)) AS c"
    )
    save_answer(answer, tmp_path / "a.csv", store.folder)
    with (tmp_path / "a.csv").open(newline="") as file:
        assert list(csv.reader(file)) == [["'=a", "b", "c"], ["'=1+1", "-1.5", "-2.5"]]


ENDLESS = "SELECT count(*) FROM range(1000000000) a, range(1000000000) b WHERE a.range > b.range"


@pytest.mark.parametrize("sql", [ENDLESS, "SELECT a.range FROM range(100000000000) a"])
def test_a_query_ends_after_its_time(store: Store, sql: str) -> None:
    began = time.monotonic()
    with pytest.raises(QueryError, match=r"stopped after its time limit of 0\.5 s") as caught:
        query_store(store, sql, Limits(seconds=0.5, memory=2**36))
    assert time.monotonic() - began < 5.0
    assert "(--time-limit)" in caught.value.remedy
    assert "(argument 'limits')" in str(caught.value)


@pytest.mark.parametrize(
    "sql",
    [
        "SELECT list(range) FROM range(100000000)",  # in the database
        "SELECT range FROM range(100000000)",  # in the answer
        pytest.param(
            "SELECT [range, range + 1] AS pair, 'a text' AS word FROM range(100000000)",
            marks=pytest.mark.exhaustive,
        ),
    ],
)
def test_a_query_ends_beyond_its_memory(store: Store, sql: str) -> None:
    with pytest.raises(QueryError, match="more than its memory limit of 64 MiB") as caught:
        query_store(store, sql, Limits(seconds=60.0, memory=64 * 2**20))
    assert "(--memory-limit)" in caught.value.remedy


def test_a_query_cannot_change_its_limits(store: Store) -> None:
    with pytest.raises(QueryError):
        query_store(store, "SET memory_limit = '10GB'; SELECT 1")
    assert query_store(store, "SELECT current_setting('temp_directory')").rows == [("",)]
