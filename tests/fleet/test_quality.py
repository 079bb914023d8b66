# SPDX-License-Identifier: MIT
"""Shift quality of units against the rest of their fleet."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivetwin.cli import main
from drivetwin.fleet import quality
from drivetwin.fleet.store import Store
from drivetwin.vehicle.shift_kind import ShiftKind
from tests.fleet.toys import fill

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
    found = dict(quality.compare_units(units))
    assert [unit for unit, one in found.items() if one.differs] == ["04"]
    slow = found["04"]
    assert slow.counts == (108, 12)
    assert slow.difference is not None
    assert slow.difference.interval[0] < 0.15 < slow.difference.interval[1]


def test_many_values_are_thinned_to_their_quantiles() -> None:
    values = np.random.default_rng(4).lognormal(size=5000)
    (thinned,) = quality.merge_figures([{_KEY: values}], 1000).values()
    assert thinned.size == 1000
    assert np.median(thinned) == pytest.approx(np.median(values), rel=1e-3)
    (whole,) = quality.merge_figures([{_KEY: values[:10]}, {_KEY: values[10:20]}], 1000).values()
    assert np.array_equal(whole, values[:20])


def test_figures_of_a_store_are_those_of_its_shifts_by_unit(tmp_path: Path) -> None:
    shifts = [(True, 1.0, 1.5, "2", "3", _UP.value), (False, 2.0, 2.5)]
    with Store(tmp_path / "store", write=True) as store:
        for log, unit, duration in (("a", "1", 0.5), ("b", "2", 0.7)):
            rows = [("quality", "shift_time", duration, {"shift": 0}),
                    ("quality", "slip_at_lockup", 0.1, {"shift": 0})]  # fmt: skip
            fill(store, log, rows, shifts, unit=unit)
        assert quality.collect_unit_figures(store) == {"1": {_KEY: [0.5]}, "2": {_KEY: [0.7]}}
    page = tmp_path / "page.html"
    assert main(["fleet", "report", str(tmp_path / "store"), "-o", str(page)]) == 0
    assert "Shift quality of the fleet" in page.read_text("utf-8")
    assert "Shift time [ms]" in page.read_text("utf-8")
