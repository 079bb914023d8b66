# SPDX-License-Identifier: MIT
"""Shift quality of units against the rest of their fleet."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivetwin.fleet import parts
from drivetwin.fleet.index import FileRow
from drivetwin.fleet.quality import collect_unit_figures, compare_units, merge_figures
from drivetwin.fleet.report import render_fleet
from drivetwin.fleet.rows import Row, RowKind
from drivetwin.fleet.store import Store
from drivetwin.fleet.task import Outcome, ShiftRow, State
from drivetwin.vehicle.shift_kind import ShiftKind

_UP = ShiftKind.POWER_ON_UP
_KEY = (_UP, "2→3", "shift_time")


def test_the_slow_unit_differs_and_the_others_do_not() -> None:
    generator = np.random.default_rng(3)
    units = {
        f"{number:02d}": {
            _KEY: (0.65 if number == 4 else 0.5) * np.exp(0.1 * generator.standard_normal(12))
        }
        for number in range(10)
    }
    found = dict(compare_units(units))
    assert [unit for unit, one in found.items() if one.differs] == ["04"]
    slow = found["04"]
    assert slow.counts == (108, 12)
    assert slow.difference is not None
    assert slow.difference.interval[0] < 0.15 < slow.difference.interval[1]


def test_many_values_are_thinned_to_their_quantiles() -> None:
    values = np.random.default_rng(4).lognormal(size=5000)
    (thinned,) = merge_figures([{_KEY: values}], 1000).values()
    assert thinned.size == 1000
    assert np.median(thinned) == pytest.approx(np.median(values), rel=1e-3)
    (whole,) = merge_figures([{_KEY: values[:10]}, {_KEY: values[10:20]}], 1000).values()
    assert np.array_equal(whole, values[:20])


def test_figures_of_a_store_are_those_of_its_shifts_by_unit(tmp_path: Path) -> None:
    shift = ShiftRow(True, 1.0, 1.5, "2", "3", _UP.value)
    refused = ShiftRow(False, 2.0, 2.5, reason="no lock-up")
    with Store(tmp_path, write=True) as store:
        for log, unit, duration in (("a", "1", 0.5), ("b", "2", 0.7)):
            outcome = Outcome(State.DONE, (shift, refused))
            rows = [
                Row(RowKind.QUALITY, "shift_time", duration, shift=0),
                Row(RowKind.QUALITY, "slip_at_lockup", 0.1, shift=0),
            ]
            parts.write_part(store.get_part_path(log), log, outcome, rows)
            store.index.add_waiting_log(log, "c", "s", "v")
            store.index.set_outcome(log, outcome, 1.0)
            store.index.set_file(FileRow(log, log, "c", 1, 1, "", unit, {}))
        assert collect_unit_figures(store) == {"1": {_KEY: [0.5]}, "2": {_KEY: [0.7]}}
        page = render_fleet(store, [], tmp_path)
    assert "Shift quality of the fleet" in page
    assert "Shift time [ms]" in page
