# SPDX-License-Identifier: MIT
"""Rate, range and gaps of each column of a file, as `inspect` lists them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivetwin.cli import main
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.write import write_log


def survey(path: Path, capsys: pytest.CaptureFixture[str]) -> dict[str, Any]:
    """Columns by name, and all that is said of the file."""
    main(["inspect", str(path), "--json"])
    printed: dict[str, Any] = json.loads(capsys.readouterr().out)
    return {one["name"]: one for one in printed["columns"]} | {"": json.dumps(printed)}


def test_rate_range_and_gaps(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    time = np.arange(0.0, 3.0, 0.01)
    time = time[(time < 1.0) | (time > 1.5)]
    values = 100.0 + time
    values[10] = np.nan
    path = tmp_path / "log.mf4"
    write_log(path, [RawChannel("n", "rpm", time, values)])
    column = survey(path, capsys)["n"]
    assert (column["group"], column["unit"]) == ("raster 1", "rpm")
    assert column["rate"] == pytest.approx(100.0)
    assert column["range"] == [100.0, 100.0 + time[-1]]
    assert column["gaps"] == 2


def test_a_held_signal_has_the_rate_of_its_sender_and_a_text_is_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    time = np.arange(0.0, 3.0, 0.001)
    path = tmp_path / "log.csv"
    rows = (f"{t:.3f},{np.floor(t / 0.02 + 1e-9):g},{'eco' if t < 1.0 else 'sport'}" for t in time)
    path.write_text("\n".join(["time [s],te [Nm],state", *rows]) + "\n")
    found = survey(path, capsys)
    assert found["te"]["rate"] == pytest.approx(50.0)
    assert "state: line 2: 'eco' is no number" in found[""]
