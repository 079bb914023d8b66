# SPDX-License-Identifier: MIT
"""Page of the shifts of a drive."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from drivetwin.report.whole_drive import build_comparison_table, render_whole_drive
from drivetwin.shifts.summary import compare_drives
from tests.report.sample import SHIFT, log


def test_an_outlying_shift_is_shown_in_its_place() -> None:
    durations = 0.5 * np.exp(0.1 * np.random.default_rng(7).standard_normal(20))
    durations[11] = 1.5
    shifts = [
        replace(SHIFT, quality={"shift_time": float(one)}, lockup_time=SHIFT.lockup_time + 1e-3 * k)
        for k, one in enumerate(durations)
    ]
    page = render_whole_drive(shifts, log(), compare_drives(shifts, shifts))
    assert 'href="#outliers"' in page
    # Over the gears, over time, and the outlying shift.
    assert page.count("<figure>") == 3
    cells = [row[-1].text for row in build_comparison_table(compare_drives(shifts, shifts)).rows]
    assert cells == ["not shown"]
