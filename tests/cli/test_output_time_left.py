# SPDX-License-Identifier: MIT
"""The line on a running step: quiet at first, then share and time left."""

from __future__ import annotations

import pytest

from drivetwin.cli.output import Remaining, format_duration


class Clock:
    """A clock that a test sets."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_a_short_step_shows_no_numbers() -> None:
    clock = Clock()
    line = Remaining("reading", clock)
    line.update(0.5, "channels")
    clock.now += 0.9
    assert str(line) == "reading"


def test_time_left_follows_from_the_share_done() -> None:
    clock = Clock()
    line = Remaining("identifying", clock)
    clock.now += 6.0
    line.update(0.25, "likelihood")
    assert str(line) == "identifying, likelihood: 25 %, about 18 s left"


def test_time_left_counts_down_between_two_shares() -> None:
    clock = Clock()
    line = Remaining("identifying", clock)
    clock.now += 10.0
    line.update(0.5, "")
    clock.now += 4.0
    assert str(line) == "identifying: 50 %, about 6 s left"


def test_an_estimate_that_was_too_short_is_not_shown() -> None:
    """No "about 1 s left" for most of the time."""
    clock = Clock()
    line = Remaining("identifying", clock)
    clock.now += 10.0
    line.update(0.9, "")
    clock.now += 30.0
    assert str(line) == "identifying: 90 %, 40 s so far"


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


def test_no_time_left_before_a_share_that_carries_it() -> None:
    clock = Clock()
    line = Remaining("identifying", clock)
    clock.now += 4.0
    line.update(0.02, "")
    assert line.estimate_time_left() is None
    assert str(line) == "identifying: 4 s so far"


def test_without_a_share_the_time_passed_is_shown() -> None:
    clock = Clock()
    line = Remaining("reading", clock)
    clock.now += 4.0
    assert str(line) == "reading: 4 s so far"
    line.update(1.0, "")
    assert str(line) == "reading: 4 s so far"


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(0.2, "1 s"), (59.4, "59 s"), (61.0, "1 min"), (150.0, "2 min"), (5400.0, "1.5 h")],
)
def test_durations_are_rounded_for_people(seconds: float, text: str) -> None:
    assert format_duration(seconds) == text
