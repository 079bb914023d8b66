# SPDX-License-Identifier: MIT
"""`drivetwin fleet --method likelihood`: a log to the end of its time, then to its rows."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from drivetwin.cli import main
from tests.support.synthetic_fleet import Truth, make_fleet, plan

MOST = 4.0
"""Standard errors within which a truth must lie; beyond that is no chance."""


@pytest.fixture(scope="module")
def logs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """One made log."""
    folder = tmp_path_factory.mktemp("likelihood") / "logs"
    make_fleet(folder, 1)
    return folder


def _run(logs: Path, capsys: pytest.CaptureFixture[str], *more: str) -> dict[str, Any]:
    """Run the fleet; its summary."""
    command = ["fleet", str(logs), "--vehicle", str(logs / "rules.toml"), "--json", *more]
    assert main([*command, "-o", str(logs.parent / "store"), "--method", "likelihood"]) == 0
    return dict(json.loads(capsys.readouterr().out.splitlines()[-1]))


def test_a_log_beyond_its_time_is_done_when_it_is_given_more(
    logs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    short = _run(logs, capsys, "--time-limit", "0.3")
    assert (short["quarantined"], short["failures"]) == (1, {"TimeLimit": 1})
    again = _run(logs, capsys)
    assert (again["quarantined"], again["computed"]) == (1, 0)
    enough = _run(logs, capsys, "--retry")
    assert (enough["done"], enough["computed"], enough["failures"]) == (1, 1, {})
    (made,) = plan(1, Truth())
    sql = "SELECT * FROM parameters"
    assert main(["fleet", "query", str(logs.parent / "store"), sql, "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    parameters = {row["name"]: row for row in rows}
    assert parameters["eta"]["method"] == "likelihood"
    truths = {"mu.B3": made.mu, "P0.B3": made.P0}
    for name, true in truths.items():
        row = parameters[name]
        assert abs(row["free_value"] - true) < MOST * row["free_std"], name
    assert parameters["P0.B3"]["free_std"] > parameters["P0.B3"]["std_noise"] > 0.0
    assert parameters["mu.B3"]["std_total"] > parameters["mu.B3"]["free_std"] > 0.0
    assert abs(parameters["eta"]["value"] - 0.85) < MOST * parameters["eta"]["std_total"]
