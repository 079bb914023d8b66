# SPDX-License-Identifier: MIT
"""Shift quality of units against the rest of their fleet."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from drivetwin.cli import main
from drivetwin.fleet.figures import compare_units
from drivetwin.vehicle.spec import ShiftKind
from tests.fleet.toys import fill, open_store

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


def test_the_page_shows_figures_of_the_shifts(tmp_path: Path) -> None:
    shifts = [(True, 1.0, 1.5, "2", "3", _UP.value), (False, 2.0, 2.5)]
    with open_store(tmp_path / "store") as store:
        for log, unit, duration in (("a", "1", 0.5), ("b", "2", 0.7)):
            rows = [("quality", "shift_time", duration, {"shift": 0}),
                    ("quality", "slip_at_lockup", 0.1, {"shift": 0})]  # fmt: skip
            fill(store, log, rows, shifts, unit=unit)
    page = tmp_path / "page.html"
    assert main(["fleet", "report", str(tmp_path / "store"), "-o", str(page)]) == 0
    assert "Shift quality of the fleet" in page.read_text("utf-8")
    assert "Shift time [ms]" in page.read_text("utf-8")
