# SPDX-License-Identifier: MIT
"""Ratios of two speeds keep their intervals where the speeds are rounded coarsely."""

from __future__ import annotations

import numpy as np

from drivetwin.bus.alignment import estimate_alignment, split_span
from drivetwin.bus.recording import Signal

RATIO, INPUT_STEP, OUTPUT_STEP = 1.91, 5.0, 1.0


def test_rounding_of_a_steady_speed_is_part_of_the_interval() -> None:
    """An error of rounding is the same over all samples that show one number."""
    time = np.arange(0.0, 4.0, 0.01)
    off = []
    for output in np.linspace(90.0, 92.0, 21):
        speed = output + 0.4 * time
        rounded = {
            step: Signal("n", time, step * np.round(values / step), step / np.sqrt(12.0))
            for step, values in ((INPUT_STEP, RATIO * speed), (OUTPUT_STEP, speed))
        }
        spans = split_span("", "2", (0.5, 2.4), rounded[INPUT_STEP], rounded[OUTPUT_STEP], 0.05)
        found = estimate_alignment(spans, 0.0)
        assert found is not None
        (one,) = found.ratios["2"]
        off.append((one.value[0] - RATIO) * np.sqrt(one.information[0, 0]))
    assert np.mean(np.abs(off) < 2.0) > 0.9
    assert np.std(off) > 0.2
