# SPDX-License-Identifier: MIT
"""`drivetwin fleet` from end to end: run, resume, report, estimate, query."""

from __future__ import annotations

import json
import re
import shutil
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from drivetwin.cli import main
from tests.support.synthetic_fleet import make_fleet

COUNT = 8


@pytest.fixture(scope="module")
def fleet(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store of a few made logs, one of them empty, with single reports."""
    folder = tmp_path_factory.mktemp("fleet")
    make_fleet(folder / "logs", COUNT)
    (folder / "logs" / "unit_07" / "empty_at_1.0_Mm.csv").write_bytes(b"")
    command = ["fleet", str(folder / "logs"), "--vehicle", str(folder / "logs" / "rules.toml")]
    command += ["-o", str(folder / "store"), "--quick", "--workers", "1"]
    assert main([*command, "--reports"]) == 0
    return folder


def _run(fleet: Path, *more: str) -> int:
    rules = str(fleet / "logs" / "rules.toml")
    command = ["fleet", str(fleet / "logs"), "--vehicle", rules, "-o", str(fleet / "store")]
    return main([*command, "--quick", "--workers", "1", *more])


def test_a_second_run_computes_nothing_and_tells_events(
    fleet: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert _run(fleet, "--json") == 0
    events = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [event["event"] for event in events] == ["started", *(COUNT + 1) * ["log"], "summary"]
    assert not any(event.get("computed") for event in events)
    (bad,) = [event for event in events if event.get("state") == "bad"]
    assert bad["path"].endswith("empty_at_1.0_Mm.csv")
    assert bad["error"] == "FileFormatError"


def test_the_store_holds_the_results_of_each_log(
    fleet: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    def ask(sql: str) -> list[dict[str, Any]]:
        assert main(["fleet", "query", str(fleet / "store"), sql, "--json"]) == 0
        rows: list[dict[str, Any]] = json.loads(capsys.readouterr().out)["rows"]
        return rows

    values = {row["name"]: row for row in ask("SELECT * FROM parameters WHERE unit = '00'")}
    assert values["eta"]["value"] == pytest.approx(0.85, abs=0.01)
    assert values["mu.B3"]["at"] == 50.0
    assert values["P0.B3"]["free_std"] > values["P0.B3"]["std_noise"]
    etas = ask("SELECT unit, odometer_Mm FROM parameters WHERE name = 'eta' ORDER BY unit")
    assert [row["unit"] for row in etas] == [f"{unit:02d}" for unit in range(COUNT)]
    assert all(0.0 <= row["odometer_Mm"] <= 200.0 for row in etas)
    shifts = ask("SELECT start_gear, end_gear, state FROM shifts")
    assert [tuple(row.values()) for row in shifts] == COUNT * [("2", "3", "used")]


def test_the_report_links_to_single_ones_with_one_library(
    fleet: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["fleet", "report", str(fleet / "store"), "--json"]) == 0
    page = Path(json.loads(capsys.readouterr().out)["report"])
    text = page.read_text("utf-8")
    assert 'src="reports/plotly.js"' in text
    assert "empty_at_1.0_Mm.csv" in text
    assert len(text) < 1_000_000
    singles = list((fleet / "store" / "reports").glob("*.html"))
    assert len(singles) == COUNT
    assert all('src="plotly.js"' in single.read_text("utf-8") for single in singles)


@pytest.mark.parametrize("place", ["store/again.html", "elsewhere.html"])
def test_links_lead_to_every_single_report_from_wherever_the_page_is(
    fleet: Path, place: str
) -> None:
    page = fleet / place
    assert main(["fleet", "report", str(fleet / "store"), "-o", str(page)]) == 0
    links = set(re.findall(r'href="([^"#]+\.html)"', page.read_text("utf-8")))
    singles = {path.resolve() for path in (fleet / "store" / "reports").glob("*.html")}
    assert {(page.parent / link).resolve() for link in links} == singles


def test_estimates_are_told(
    fleet: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", "200")
    store = str(fleet / "store")
    assert main(["fleet", "estimate", store, "--parameter", "eta", "--json"]) == 0
    (eta,) = json.loads(capsys.readouterr().out)["estimates"]
    assert eta["ci95"][0] < 0.85 < eta["ci95"][1]
    assert main(["fleet", "estimate", store]) == 0
    out = capsys.readouterr().out
    assert "mu.B3" in out
    assert "drift per" in " ".join(out.split())
    assert "at least 6 are needed, of one unit 5" in out
    assert main(["fleet", "estimate", store, "--parameter", "mu.X9", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"estimates": [], "missing": ["mu.X9"]}


def test_logs_of_other_settings_are_told(
    fleet: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    store = tmp_path / "store"
    shutil.copytree(fleet / "store", store, ignore=shutil.ignore_patterns("reports"))
    with closing(sqlite3.connect(store / "index.sqlite")) as index, index:
        index.execute("UPDATE logs SET settings = 'older' WHERE log = (SELECT min(log) FROM logs)")
    assert main(["fleet", "estimate", str(store)]) == 0
    assert "2 different settings" in " ".join(capsys.readouterr().out.split())


def test_questions_are_answered(fleet: Path, capsys: pytest.CaptureFixture[str]) -> None:
    store = str(fleet / "store")
    sql = "SELECT unit, value FROM parameters WHERE name = 'eta' ORDER BY unit"
    for name in ("answer.csv", "answer.parquet"):
        assert main(["fleet", "query", store, sql, "-o", str(fleet / name)]) == 0
        assert (fleet / name).stat().st_size > 100
    for table in ("frictions", "fits", "qualities", "warnings", "rows", "files", "logs", "shifts"):
        assert main(["fleet", "query", store, f"SELECT count(*) FROM {table}"]) == 0
    capsys.readouterr()
    assert main(["fleet", "query", store, "SELECT nothing", "--json"]) == 2
    assert json.loads(capsys.readouterr().out)["error"]["type"] == "QueryError"


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["fleet", "--vehicle", "x.toml", "-o", "y"], "no logs are named"),
        (["fleet", "report", "nowhere"], "no store"),
        (["fleet", "*.nothing", "--vehicle", "pyproject.toml", "-o", "y"], "rules"),
    ],
)
def test_wrong_usage_is_told(
    arguments: list[str], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(arguments) == 2
    assert says in capsys.readouterr().err


def test_dates_of_a_list_are_dates_everywhere(
    fleet: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    logs = sorted((fleet / "logs").glob("*/log*.csv"))
    dated = [f"{path},2024-03-{day:02d}" for day, path in enumerate(logs, 1)]
    (tmp_path / "list.csv").write_text("\n".join(["path,recorded", *dated]))
    rules = (fleet / "logs" / "rules.toml").read_text().split("[fields")[0]
    (fleet / "logs" / "dated.toml").write_text(f'{rules}[fields.date]\ncolumn = "recorded"\n')
    command = ["fleet", "--list", str(tmp_path / "list.csv"), "--quick", "--json"]
    command += ["--vehicle", str(fleet / "logs" / "dated.toml"), "-o", str(fleet / "store")]
    assert main(command) == 0
    assert json.loads(capsys.readouterr().out.splitlines()[-1])["computed"] == 0
    sql = "SELECT max(date) - min(date) AS span, min(date) AS first FROM files"
    assert main(["fleet", "query", str(fleet / "store"), sql, "--json"]) == 0
    (row,) = json.loads(capsys.readouterr().out)["rows"]
    assert row == {"span": "7 days, 0:00:00", "first": "2024-03-01 00:00:00"}
    assert main(["fleet", "estimate", str(fleet / "store"), "--parameter", "eta"]) == 0
    assert "year" in capsys.readouterr().out
