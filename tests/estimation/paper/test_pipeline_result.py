# SPDX-License-Identifier: MIT
"""Conclusions from the paper's procedure over several shifts."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.estimation.paper.pipeline import assess_paper_shifts, identify_paper_shift
from drivetwin.estimation.result.estimate import Verdict
from tests.estimation.synthetic import Run, Truth

RANGES = ((5.0, 40.0), (5000.0, 9000.0))
SHAFT = ("k_o", "c_o", "f_d_3", "zeta_3")


def test_what_the_first_shift_cannot_tell_comes_from_the_next(stepped: Run) -> None:
    signals, driveline = stepped.signals(), Truth().driveline()
    second = identify_paper_shift(signals, driveline, *RANGES)
    kept = {name: value for name, value in second.values.items() if name not in SHAFT}
    first = replace(second, values={**kept, "eta": 1.5}, refusals={"shaft": "no clean lock-up"})
    both = [signals, signals], [driveline, driveline]
    reported = assess_paper_shifts([first, second], *both).estimates
    for name in ("eta", *SHAFT):
        assert reported[name].value == pytest.approx(second.values[name])
        assert reported[name].verdict is Verdict.WEAK
    alone = assess_paper_shifts([first], [signals], [driveline]).estimates
    for name in ("eta", *SHAFT):
        assert alone[name].value is None
    assert alone["k_o"].reason.startswith("no clean lock-up")
