# SPDX-License-Identifier: MIT
"""Gaps of a log cost precision, and their samples are not joined."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import DamagedChannelError
from drivetwin.estimation.identification import Identification
from drivetwin.findings import render
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from tests.estimation.asked import record_log, stepped
from tests.support.repeats import mark_repeats

STEP = (1.0, 1.3)
"""A throttle step of the log lies in here: a straight line over it is far from the truth."""
LATE, EARLY = (-1.0, 0.5), (3.1, 9.0)
"""Before the first and after the last sample of a channel that starts late or ends early."""
SHIFTING = (2.36, 2.42)
Gaps = dict[str, tuple[float, float]]


def _cut(gaps: Gaps) -> ShiftLog:
    log, _ = record_log("paper_steps")
    channels = dict(log.channels)
    for role, (start, end) in gaps.items():
        one = channels[role]
        keep = (one.time < start) | (one.time > end)
        channels[role] = replace(one, time=one.time[keep], values=one.values[keep])
    return replace(log, channels=channels)


def _identify(log: ShiftLog) -> Identification:
    _, card = record_log("paper_steps")
    return identify(log, card, detect_shifts(log, card))


def _list_moved(found: Identification) -> list[str]:
    """List parameters whose undamaged value lies outside the interval of the damaged log.

    μ times gain is left out: it is a mean over the slips that a log shows.
    """
    wrong = []
    for name, sound in stepped().estimates.items():
        if sound.value is None or not sound.std_total or name.startswith("mu_gain"):
            continue
        interval = found.estimates[name].ci95_total if name in found.estimates else None
        if interval is None or not interval[0] <= sound.value <= interval[1]:
            wrong.append(name)
    return wrong


DAILY: Gaps = {"engine_torque": STEP, "wheel_speed": LATE, "output_torque": SHIFTING}
CASES: list[Gaps] = [
    DAILY,
    {"engine_torque": STEP, "output_speed": (2.66, 2.68)},
    {"output_torque": STEP, "input_speed": STEP, "wheel_speed": LATE},
    {"wheel_speed": STEP, "output_torque": SHIFTING, "engine_torque": EARLY},
]


@pytest.mark.parametrize("gaps", mark_repeats(CASES, [DAILY]))
def test_gaps_cost_precision_only(gaps: Gaps) -> None:
    """Over a throttle step, in the shift, and at both ends of the log."""
    found = _identify(_cut(gaps))
    assert _list_moved(found) == []
    if gaps.get("engine_torque") == STEP:
        (shift,) = found.shifts
        assert shift.before[0] > STEP[1], "the validation keeps to the reported cut"
        assert any("no samples from" in text for text in render(shift.findings))


@pytest.mark.exhaustive
def test_the_samples_beside_a_gap_are_not_joined() -> None:
    """Bridged, the same gap would move η by several standard deviations."""
    log, _ = record_log("paper_steps")
    cut, time = _cut({"engine_torque": STEP})["engine_torque"], log["engine_torque"].time
    joined = replace(cut, time=time, values=np.interp(time, cut.time, cut.values), held=False)
    wrong = _identify(replace(log, channels={**log.channels, "engine_torque": joined}))
    assert "eta" in _list_moved(wrong)


def test_a_gap_in_the_shift_refuses_the_only_one() -> None:
    with pytest.raises(DamagedChannelError, match="during the shift"):
        _identify(_cut({"pressure.B3": (2.35, 2.40)}))
