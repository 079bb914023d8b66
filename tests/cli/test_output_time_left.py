# SPDX-License-Identifier: MIT
"""The line on a running step: quiet at first, then share and time left."""

from __future__ import annotations

import pytest

from drivetwin.cli.output import Remaining


class Clock:
    """A clock that a test sets."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_time_left_follows_from_the_share_done() -> None:
    clock = Clock()
    line = Remaining("identifying", clock)
    clock.now += 6.0
    line.update(0.25, "likelihood")
    assert str(line) == "identifying, likelihood: 25 %, about 18 s left"


def test_the_time_left_is_smooth() -> None:
    """A jump of the share moves the time left by a part of the jump at first."""
    clock = Clock()
    line = Remaining("identifying", clock)
    clock.now += 10.0
    line.update(0.25, "")
    clock.now += 0.1
    line.update(0.5, "")
    left = line.estimate_time_left()
    assert left is not None
    assert 20.0 < left < 30.0
    clock.now += 5.0
    line.update(0.55, "")
    left = line.estimate_time_left()
    assert left == pytest.approx(15.1 * 0.45 / 0.55, rel=0.1)
