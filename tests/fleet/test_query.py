# SPDX-License-Identifier: MIT
"""Questions to a store: each log counts once, wherever its file stands."""

from __future__ import annotations

import csv
import json
import time
from pathlib import Path
from typing import Any

import pytest

from drivetwin.cli import main
from tests.fleet.toys import make_logs, run_toys

Capture = pytest.CaptureFixture[str]


def ask(capsys: Capture, store: Path, sql: str, *more: str) -> Any:
    """Rows of the answer, or the error."""
    capsys.readouterr()
    code = main(["fleet", "query", str(store), sql, *more, "--json"])
    found = json.loads(capsys.readouterr().out)
    return [tuple(row.values()) for row in found["rows"]] if code == 0 else found["error"]


def test_a_moved_or_copied_log_counts_once_where_it_is_now(tmp_path: Path, capsys: Capture) -> None:
    logs, store = make_logs(tmp_path / "logs", 3), tmp_path / "store"
    run_toys(logs, store)
    (logs / "unit_0" / "log_0000.csv").rename(logs / "unit_2" / "log_0000.csv")
    (logs / "unit_1" / "copy.csv").write_bytes((logs / "unit_1" / "log_0001.csv").read_bytes())
    run_toys(logs, store)
    sql = "SELECT log, unit FROM parameters GROUP BY ALL ORDER BY unit"
    answer = ask(capsys, store, sql)
    assert [unit for _, unit in answer] == ["unit_1", "unit_2", "unit_2"]
    assert len({log for log, _ in answer}) == 3
    assert len(ask(capsys, store, "SELECT unit FROM files")) == 5
    rows = ask(capsys, store, "SELECT count(*) FROM rows WHERE kind = 'parameter'")
    assert ask(capsys, store, "SELECT count(*) FROM parameters") == rows


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("asked")
    run_toys(make_logs(folder / "logs", 2), folder / "store")
    (folder / "secret.csv").write_text("a,b\n1,2\n")
    return folder / "store"


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
def test_a_query_only_reads(store: Path, sql: str, capsys: Capture) -> None:
    folder = store.parent
    before = sorted(folder.rglob("*"))
    asked = sql.format(out=folder / "out", secret=folder / "secret.csv")
    assert ask(capsys, store, asked)["type"] == "QueryError"
    assert sorted(folder.rglob("*")) == before


@pytest.mark.parametrize(
    "sql",
    ["WITH a AS (SELECT 1) SELECT * FROM a", "EXPLAIN SELECT 1", "DESCRIBE rows", "SHOW TABLES",
     "FROM files", "VALUES (1)"],
)  # fmt: skip
def test_questions_are_answered(store: Path, sql: str, capsys: Capture) -> None:
    assert isinstance(ask(capsys, store, sql), list)


@pytest.mark.parametrize("name", ["a.csv", "rows/a.csv", "rows/../a.parquet"])
def test_answers_stay_out_of_the_store(store: Path, name: str, capsys: Capture) -> None:
    error = ask(capsys, store, "SELECT 1 AS a", "-o", str(store / name))
    assert "into the store" in error["what"]


def test_answers_are_safe_for_spreadsheets(store: Path, tmp_path: Path, capsys: Capture) -> None:
    sql = "SELECT '=1+1' AS \"=a\", -1.5 AS b, CAST(-2.5 AS DECIMAL(3,1)) AS c"
    ask(capsys, store, sql, "-o", str(tmp_path / "a.csv"))
    with (tmp_path / "a.csv").open(newline="") as file:
        assert list(csv.reader(file)) == [["'=a", "b", "c"], ["'=1+1", "-1.5", "-2.5"]]


def test_a_query_ends_after_its_time(store: Path, capsys: Capture) -> None:
    sql = "SELECT count(*) FROM range(1000000000) a, range(1000000000) b WHERE a.range > b.range"
    began = time.monotonic()
    error = ask(capsys, store, sql, "--time-limit", "0.5")
    assert "stopped after its time limit of 0.5 s" in error["what"]
    assert "(--time-limit)" in error["remedy"]
    assert time.monotonic() - began < 5.0


@pytest.mark.parametrize(
    "sql",
    [
        "SELECT list(range) FROM range(100000000)",  # in the database
        pytest.param("SELECT range FROM range(100000000)", marks=pytest.mark.exhaustive),
    ],
)
def test_a_query_ends_beyond_its_memory(store: Path, sql: str, capsys: Capture) -> None:
    error = ask(capsys, store, sql, "--memory-limit", "64")
    assert "more than its memory limit of 64 MiB" in error["what"]
    assert "(--memory-limit)" in error["remedy"]


def test_a_query_cannot_change_its_limits(store: Path, capsys: Capture) -> None:
    error = ask(capsys, store, "SET memory_limit = '10GB'; SELECT 1")
    assert error["type"] == "QueryError"
    assert ask(capsys, store, "SELECT current_setting('temp_directory')") == [("",)]
