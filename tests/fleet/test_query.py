# SPDX-License-Identifier: MIT
"""Questions to a store: each log counts once, wherever its file stands."""

from __future__ import annotations

from pathlib import Path

from drivetwin.fleet.mixed_model.observations import collect_facts
from drivetwin.fleet.query import query_store
from drivetwin.fleet.store import Store
from tests.fleet.toys import make_logs, run_toys


def test_a_log_that_was_moved_belongs_where_it_is_now(tmp_path: Path) -> None:
    logs = make_logs(tmp_path / "logs", 3)
    run_toys(logs, tmp_path / "store")
    (logs / "unit_0" / "log_0000.csv").rename(logs / "unit_2" / "log_0000.csv")
    run_toys(logs, tmp_path / "store")
    with Store(tmp_path / "store") as store:
        units = sorted(fact.unit for _, fact in collect_facts(store).values())
        answer = query_store(store, "SELECT log, unit FROM parameters GROUP BY ALL ORDER BY unit")
        files = query_store(store, "SELECT unit FROM files ORDER BY unit")
    assert units == [row[1] for row in answer.rows] == ["unit_1", "unit_2", "unit_2"]
    assert len({row[0] for row in answer.rows}) == 3
    assert len(files.rows) == 4


def test_a_log_that_stands_twice_counts_once(tmp_path: Path) -> None:
    logs = make_logs(tmp_path / "logs", 2)
    (logs / "unit_1" / "copy.csv").write_bytes((logs / "unit_0" / "log_0000.csv").read_bytes())
    run_toys(logs, tmp_path / "store")
    with Store(tmp_path / "store") as store:
        rows = query_store(store, "SELECT count(*) FROM rows WHERE kind = 'parameter'").rows
        assert query_store(store, "SELECT count(*) FROM parameters").rows == rows
