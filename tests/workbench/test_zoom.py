# SPDX-License-Identifier: MIT
"""Zoom: the window of an event, and the samples that are sent for it."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np
import pytest

from drivetwin._util.display_units import NM
from drivetwin.report.figures.stack import Curve, Panel
from drivetwin.workbench.zoom import collect_curves, parse_view
from tests.support.arrays import FloatArray


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


@pytest.mark.parametrize("start", [0.0, 90_000.0])
def test_every_sample_in_view_is_sent(start: float) -> None:
    time: FloatArray = start + np.arange(600_000, dtype=np.float64) * 1e-3
    curve = Curve("T", time, np.sin(time).astype(np.float64), "#000")
    view = (start + 300.0, start + 301.0)
    (sent,) = collect_curves([Panel("torque", NM, [curve])], view).values()
    x = np.frombuffer(base64.b64decode(sent["x"]["bdata"]), sent["x"]["dtype"])
    assert x.size < 10_000
    inside = x[(x >= view[0]) & (x <= view[1])]
    assert inside.size == pytest.approx(1001, abs=1)
    assert np.diff(inside) == pytest.approx(1e-3, abs=1e-4)


def test_the_only_shift_in_the_window_is_selected(identified: Any) -> None:
    lockup = identified.work.require_shift().lockup_time
    assert not identified.set_view((lockup - 0.1, lockup + 0.1))
    assert identified.view == (lockup - 0.1, lockup + 0.1)
    assert identified.work.shift == 0
