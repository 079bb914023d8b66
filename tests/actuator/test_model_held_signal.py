# SPDX-License-Identifier: MIT
"""Held signals: values between changes, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.actuator.model import HeldSignal
from drivetwin.errors import InputError


def test_a_value_holds_to_the_next_and_before_the_first() -> None:
    held = HeldSignal(np.array([1.0, 2.0, 3.0]), np.array([5.0, 5.0, 7.0]))
    assert held.evaluate(np.array([0.0, 1.0, 2.99, 3.0, 9.0])).tolist() == [5, 5, 5, 7, 7]
    changes = held.drop_repeated()
    assert changes.time.tolist() == [1.0, 3.0]
    assert changes.evaluate(np.array([2.5, 3.5])).tolist() == [5, 7]


@pytest.mark.parametrize(
    ("time", "values", "says"),
    [
        ([], [], "0 times"),
        ([0.0, 1.0], [1.0], "2 times and 1 values"),
        ([0.0, 0.0], [1.0, 2.0], "do not increase"),
        ([0.0, 1.0], [1.0, np.nan], "not finite"),
    ],
)
def test_other_signals_are_refused(time: list[float], values: list[float], says: str) -> None:
    with pytest.raises(InputError, match=says):
        HeldSignal(np.array(time), np.array(values))
