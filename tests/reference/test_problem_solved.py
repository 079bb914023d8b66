# SPDX-License-Identifier: MIT
"""The committed values are those that the committed solution scripts compute."""

from __future__ import annotations

import numpy as np
import pytest

from reference import tables
from reference.__main__ import solved
from reference.problem import ROOT, load

QUICK = (
    "coupled_clutches",
    "lossy_gear_with_bearing",
    "backlash",
    "redundant_locks",
    "tie_up",
    "tyre",
)


@pytest.mark.parametrize("name", QUICK)
def test_the_script_reproduces_the_committed_values(name: str) -> None:
    committed, anew = tables.read(ROOT / name), solved(name)
    for output, tolerance in load(name).tolerance.items():
        difference = committed.table.columns[output] - anew.table.columns[output]
        assert np.abs(difference).max() < 0.1 * tolerance, output
    assert [change[1:] for change in anew.changes] == [change[1:] for change in committed.changes]
    times = [change.time for change in committed.changes]
    assert [change.time for change in anew.changes] == pytest.approx(times, rel=0.0, abs=1e-8)
