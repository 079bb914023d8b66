# SPDX-License-Identifier: MIT
"""A worker under guard: versions, output of a log and faults of a log."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivetwin.errors import StoreError
from tests.fleet.toys import contents, make_logs, names, run_toys


def test_what_a_log_does_to_its_worker_stops_no_other(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Print, fail to be read, be empty; one worker does them all, with the memory that it has."""
    monkeypatch.setenv("MALLOC_TRIM_THRESHOLD_", "65536")
    logs = make_logs(tmp_path / "logs", 4, spoilt=["print", "unread", "environment"])
    (logs / "unit_0" / "log_0003.csv").write_text("")
    summary, events = run_toys(logs, tmp_path / "store")
    assert (summary.done, summary.bad, summary.quarantined) == (2, 1, 1)
    assert names(events, error="IndexError") == ["log_0003"]
    assert names(events, error="OSError") == ["log_0001"]
    found = contents(tmp_path / "store")
    assert {one["end"] for one in found["shifts"]} == {2.0}  # no setting of memory is a third word
    (fault,) = [one for one in found["logs"] if one["error"] == "OSError"]
    assert fault["state"] == "quarantined"
    assert "Input/output error" in fault["what"]
    assert "--retry" in fault["remedy"]


def test_another_version_is_not_mixed_in(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    logs = make_logs(tmp_path / "logs", 1)
    monkeypatch.setattr("drivetwin.fleet.scan.get_program_version", lambda: "0.0.0+other")
    with pytest.raises(StoreError, match=r"0\.0\.0\+other"):
        run_toys(logs, tmp_path / "store")
    assert contents(tmp_path / "store")["rows"] == []
