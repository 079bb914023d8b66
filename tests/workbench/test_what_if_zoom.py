# SPDX-License-Identifier: MIT
"""Zoom: the window of an event, and the samples that are sent for it."""

from __future__ import annotations

from typing import Any

import pytest

from drivetwin.workbench.what_if import parse_view


@pytest.mark.parametrize(
    ("change", "view"),
    [
        ({"xaxis.range[0]": 1, "xaxis.range[1]": 2.5}, (1.0, 2.5)),
        ({"xaxis.range": [1.0, 2.0], "yaxis.range": [0, 1]}, (1.0, 2.0)),
        ({"xaxis.autorange": True}, None),
        ({"xaxis.range": [2.0, 1.0]}, None),
        ({"xaxis.range": ["a", None]}, None),
        ({"xaxis.range[0]": float("nan"), "xaxis.range[1]": 1.0}, None),
        ({"xaxis.range": [0, 10**400]}, None),
        ({"xaxis.range": [False, True]}, None),
        ({"shapes[0].x0": 1.0}, None),
        ({}, None),
    ],
)
def test_the_window_of_an_event(change: dict[str, Any], view: tuple[float, float] | None) -> None:
    assert parse_view(change) == view


def test_the_only_shift_in_the_window_is_selected(identified: Any) -> None:
    lockup = identified.work.require_shift().lockup_time
    assert not identified.set_view((lockup - 0.1, lockup + 0.1))
    assert identified.view == (lockup - 0.1, lockup + 0.1)
    assert identified.work.shift == 0
