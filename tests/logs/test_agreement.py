# SPDX-License-Identifier: MIT
"""Channels against each other and the card: gearing that fits, or a refusal that names both."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from drivetwin.errors import PlausibilityError
from drivetwin.logs.agreement import (
    check_gearing,
    check_torque_signs,
    partly_recorded,
    torque_balance,
)
from drivetwin.logs.roles import quantity_of
from drivetwin.logs.shiftlog import Channel
from tests.logs.made import card

TIME = np.linspace(0.0, 0.5, 50)


def speeds(**levels: float) -> dict[str, Channel]:
    return {
        role: Channel(role, quantity_of(role), TIME, np.full(50, level), f"n_{role}", "rad/s")
        for role, level in levels.items()
    }


def test_the_gears_of_the_card_and_their_neighbours_pass(tmp_path: Path) -> None:
    for ratio in (1.8, 1.4, 1.0, 3.5):
        channels = speeds(input_speed=100.0 * ratio, output_speed=100.0, wheel_speed=20.3)
        check_gearing(channels, card(tmp_path), "log.csv")


def test_exchanged_columns_are_told(tmp_path: Path) -> None:
    channels = speeds(output_speed=20.0, wheel_speed=100.0)
    with pytest.raises(PlausibilityError) as caught:
        check_gearing(channels, card(tmp_path), "log.csv")
    assert caught.value.what == (
        "output_speed ('n_output_speed', rad/s) over wheel_speed ('n_wheel_speed', rad/s) is 0.2, "
        "but the card has the final drive 5"
    )
    assert "columns are exchanged" in caught.value.remedy


def test_standstill_and_absent_speeds_show_no_gearing(tmp_path: Path) -> None:
    vehicle = card(tmp_path)
    check_gearing(speeds(input_speed=70.0, output_speed=0.0), vehicle, "log.csv")
    check_gearing(speeds(input_speed=70.0), vehicle, "log.csv")


def test_channels_that_start_late_or_end_early_are_told() -> None:
    channels = speeds(input_speed=180.0, output_speed=100.0, wheel_speed=20.0)
    assert partly_recorded(channels) == []
    late = channels["output_speed"]
    channels["output_speed"] = replace(late, time=late.time[10:], values=late.values[10:])
    channels["wheel_speed"] = replace(late, time=late.time[:40], values=late.values[:40])
    assert partly_recorded(channels) == [
        f"channel 'n_output_speed': no samples from 0.000 s to {TIME[10]:.3f} s",
        f"channel 'n_output_speed': no samples from {TIME[39]:.3f} s to 0.500 s",
    ]


def powered(ratio: float, share: float) -> dict[str, Channel]:
    """A gear of `ratio`, whose output torque is `share` of ratio times engine torque."""
    made = speeds(input_speed=100.0 * ratio, output_speed=100.0)
    for role, level in (("engine_torque", 800.0), ("output_torque", 800.0 * ratio * share)):
        made[role] = Channel(role, quantity_of(role), TIME, np.full(50, level), role, "Nm")
    return made


def test_opposite_torques_are_refused() -> None:
    check_torque_signs(powered(1.8, 0.9), "log.csv")
    with pytest.raises(PlausibilityError, match="opposite signs") as caught:
        check_torque_signs(powered(1.8, -0.9), "log.csv")
    assert "sign = -1" in caught.value.remedy


@pytest.mark.parametrize(
    ("share", "told"), [(0.9, False), (0.65, False), (0.45, True), (1.8, True)]
)
def test_a_torque_of_the_wrong_scale_is_told(tmp_path: Path, share: float, told: bool) -> None:
    texts = torque_balance(powered(1.8, share), card(tmp_path))
    assert bool(texts) == told
    if told:
        assert f"in gear 2 the output torque is {share:.2f} of ratio times" in texts[0]


def test_without_a_gear_there_is_no_balance(tmp_path: Path) -> None:
    assert torque_balance(powered(2.5, 0.3), card(tmp_path)) == []
    assert torque_balance(speeds(input_speed=180.0, output_speed=100.0), card(tmp_path)) == []
