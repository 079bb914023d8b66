# SPDX-License-Identifier: MIT
"""Inputs as they are decided: what has been stays."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.drive.schedule import Schedule

POINTS = st.lists(
    st.tuples(st.floats(0.01, 2.0), st.floats(-1e6, 1e6)), min_size=1, max_size=4
).map(lambda points: tuple(zip(np.cumsum([p[0] for p in points]).tolist(),
                               [p[1] for p in points], strict=True)))  # fmt: skip


@given(first=POINTS, start=st.floats(0.05, 5.0), second=POINTS)
def test_a_decision_leaves_the_past_as_it_was(
    first: tuple[tuple[float, float], ...],
    start: float,
    second: tuple[tuple[float, float], ...],
) -> None:
    before = Schedule({"P": ((0.0, 0.0),)}).add_knots("P", 0.0, *first)
    after = before.add_knots("P", start, *second)
    past = np.linspace(0.0, start, 50)
    assert np.allclose(after.evaluate("P", past), before.evaluate("P", past), rtol=1e-9, atol=1e-6)
    assert after.evaluate("P", np.array([start + second[-1][0]]))[0] == pytest.approx(second[-1][1])


def test_signals_span_the_time_asked_for() -> None:
    schedule = Schedule({"P": ((0.0, 1.0),)}).add_knots("P", 2.0, (1.0, 5.0))
    for end, last in ((1.0, 1.0), (2.5, 3.0), (9.0, 5.0)):
        signal = schedule.to_signals(end)["P"]
        assert (signal.time[0], signal.time[-1]) == (0.0, end)
        assert signal.values[-1] == pytest.approx(last)
