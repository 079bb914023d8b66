# SPDX-License-Identifier: MIT
"""Progress: shares of nested parts, never falling, and cancelled by the listener."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin._util.progress import attach_listener, notify_progress, scale_progress


def test_nothing_happens_without_a_listener() -> None:
    with scale_progress(0.0, 0.5, "alone"):
        notify_progress(0.3)


def test_parts_have_their_place_in_the_whole() -> None:
    heard: list[tuple[float, str]] = []
    with attach_listener(lambda share, text: heard.append((share, text))):
        with scale_progress(0.0, 0.5, "first"):
            notify_progress(0.5)
        with scale_progress(0.5, 1.0, "second"), scale_progress(0.0, 0.5):
            notify_progress(0.5)
    assert (0.25, "first") in heard
    assert (0.625, "second") in heard
    assert heard[-1] == (1.0, "second")


def test_a_listener_hears_nothing_after_its_block() -> None:
    heard: list[float] = []
    with attach_listener(lambda share, _: heard.append(share)):
        pass
    notify_progress(0.5)
    assert heard == []


def test_a_listener_cancels_by_raising() -> None:
    def refuse(share: float, _: str) -> None:
        if share > 0.5:
            raise InterruptedError

    done: list[int] = []

    def compute() -> None:
        for step in range(10):
            notify_progress(step / 10)
            done.append(step)

    with attach_listener(refuse), pytest.raises(InterruptedError):
        compute()
    assert done == [0, 1, 2, 3, 4, 5]
    notify_progress(1.0)


@given(st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1), st.floats(-1, 2)), max_size=20))
def test_shares_stay_in_bounds_and_never_fall(steps: list[tuple[float, float, float]]) -> None:
    heard: list[float] = []
    with attach_listener(lambda share, _: heard.append(share)):
        for start, end, share in steps:
            with scale_progress(min(start, end), max(start, end)):
                notify_progress(share)
    assert all(0.0 <= share <= 1.0 for share in heard)
    assert heard == sorted(heard)
