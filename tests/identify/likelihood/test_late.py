# SPDX-License-Identifier: MIT
"""An output torque that comes later than the speeds is told, and one that does not is not."""

from __future__ import annotations

from dataclasses import replace

import pytest

from benchmarks.estimation.bench import Knowledge, realise
from drivetwin.dyno.scenarios import paper_steps
from drivetwin.identify.likelihood.fit import LikelihoodFit, nearest
from drivetwin.identify.likelihood.late import late_torque, lateness_in_words
from tests.identify.likelihood.made import fitted, problem


def _with_delay(delay: float) -> LikelihoodFit:
    base = paper_steps()
    sensors = [
        replace(one, delay=delay) if one.role == "output_torque" else one for one in base.sensors
    ]
    posed, start = problem(realise(replace(base, sensors=tuple(sensors)), 0, Knowledge()))
    found = nearest(posed, start)
    assert found is not None
    return found


@pytest.mark.parametrize("delay", [0.001, 0.002])
def test_a_late_torque_is_told_with_its_delay(delay: float) -> None:
    """To first order: 2 ms are 9 degrees of the oscillation."""
    found = _with_delay(delay)
    seen, std = late_torque(found)
    assert abs(seen - delay) < 3.0 * std + 0.15 * delay
    (text,) = lateness_in_words(found)
    assert f"{1e3 * seen:.1f} ±" in text
    assert "late against the speeds" in text
    assert f"time_shift_s = -{seen:.4f}" in text


@pytest.mark.parametrize("seed", range(3))
def test_a_torque_in_time_is_not_told_late(seed: int) -> None:
    found = fitted(seed)
    seen, std = late_torque(found)
    assert abs(seen) < 3.5 * std
    assert lateness_in_words(found) == []
