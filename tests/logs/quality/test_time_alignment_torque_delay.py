# SPDX-License-Identifier: MIT
"""Delay of the output torque: found through a shift and a grade; silent where nothing tells."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel
from drivetwin.findings import render
from drivetwin.logs.quality.time_alignment import check_torque_delays, estimate_torque_delay
from tests.support.arrays import FloatArray

J_V, I_F, K_O = 6000.0, 5.0, 1.7e5
STEP = 1e-3
TIME = np.arange(0.0, 8.0, STEP)
NOISE = {"output_torque": 20.0, "output_speed": 0.05, "wheel_speed": 0.01}


def torque() -> FloatArray:
    """A power-on upshift: hole, step and the swing after lock-up [N m]."""
    hole = -1500.0 * np.exp(-(((TIME - 3.0) / 0.2) ** 2))
    step = np.where(TIME < 3.2, 2600.0, 2000.0)
    after = np.clip(TIME - 3.2, 0.0, None)
    swing = np.where(after > 0.0, 700.0 * np.exp(-4.0 * after) * np.sin(75.0 * after), 0.0)
    return np.asarray(step + hole + swing)


def recorded(grade: float = 0.0, **delays: float) -> dict[str, Channel]:
    """A vehicle driven by `torque` up a `grade` that grows [N m/s]; stamps late by `delays` [s]."""
    drive = torque()
    load = 4000.0 + grade * TIME
    wheel = 17.0 + np.cumsum(I_F * drive - load) * STEP / J_V
    output = I_F * wheel + np.gradient(drive, STEP) / K_O
    clean = {"output_torque": drive, "output_speed": output, "wheel_speed": wheel}
    rng = np.random.default_rng(4)
    return {
        role: Channel(
            role,
            Quantity.TORQUE if role == "output_torque" else Quantity.SPEED,
            TIME + delays.get(role, 0.0),
            values + rng.normal(0.0, NOISE[role], TIME.size),
            role,
            "",
        )
        for role, values in clean.items()
    }


@given(
    late=st.floats(-0.05, 0.05), grade=st.floats(-400.0, 400.0), start=st.sampled_from([0.0, 1e4])
)
def test_the_delay_of_the_wheel_speed_is_found(late: float, grade: float, start: float) -> None:
    channels = recorded(grade, wheel_speed=late)
    moved = {role: replace(one, time=one.time + start) for role, one in channels.items()}
    found = estimate_torque_delay(moved["output_torque"], moved["wheel_speed"])
    assert found is not None
    assert found.value == pytest.approx(late, abs=4.0 * found.sigma + 0.05 * abs(late))
    assert found.sigma < 2e-3


def test_a_shaft_between_torque_and_speed_is_no_delay() -> None:
    channels = recorded()
    found = estimate_torque_delay(channels["output_torque"], channels["output_speed"])
    assert found is not None
    assert abs(found.value) < 2e-3
    assert check_torque_delays(channels) == []


def test_a_late_torque_is_told_against_all_speeds() -> None:
    (text,) = render(check_torque_delays(recorded(output_torque=0.02)))
    assert "'output_torque': About" in text
    assert "late relative to 'wheel_speed' and 'output_speed'" in text
    assert "tyre slip has the same effect" in text
    assert "channels.output_torque.time_shift_s = -0.0" in text


def test_a_late_wheel_speed_is_told_against_the_torque() -> None:
    (text,) = render(check_torque_delays(recorded(wheel_speed=0.03)))
    assert re.search(r"'wheel_speed': About (29|30|31) ms late relative to 'output_torque'", text)
    assert "tyre slip" not in text
    assert re.search(r"channels\.wheel_speed\.time_shift_s = -0\.0(29|30|31)", text)


def test_two_late_channels_are_told() -> None:
    late = check_torque_delays(recorded(output_torque=0.012, wheel_speed=0.012))
    assert len(late) == 1
    assert "'output_speed': About" in late[0].text
    assert "early relative to 'output_torque'" in late[0].text


def bus(channel: Channel, period: float) -> Channel:
    """The channel as an encoder on a bus: means over `period` [s], held until the next one."""
    count = round(period / STEP)
    sums = channel.values.reshape(-1, count).mean(axis=1)
    values = np.repeat(np.concatenate((sums[:1], sums[:-1])), count)
    return replace(channel, values=values, held=True)


def test_speeds_that_are_means_and_held_do_not_make_the_torque_early() -> None:
    channels = recorded()
    held = channels | {role: bus(channels[role], 0.01) for role in ("output_speed", "wheel_speed")}
    found = estimate_torque_delay(held["output_torque"], held["wheel_speed"])
    assert found is not None
    assert found.value == pytest.approx(0.01, abs=2e-3)
    assert check_torque_delays(held) == []
    late = recorded(output_torque=0.03)
    held = late | {role: bus(late[role], 0.01) for role in ("output_speed", "wheel_speed")}
    (text,) = render(check_torque_delays(held))
    assert re.search(r"'output_torque': About 2[3-7] ms late", text)


def test_a_gap_is_not_bridged() -> None:
    channels = recorded(wheel_speed=0.03)
    wheel = channels["wheel_speed"]
    keep = (wheel.time < 4.5) | (wheel.time > 5.5)
    cut = replace(wheel, time=wheel.time[keep], values=wheel.values[keep])
    found = estimate_torque_delay(channels["output_torque"], cut)
    assert found is not None
    assert found.value == pytest.approx(0.03, abs=4.0 * found.sigma)


@pytest.mark.parametrize("case", ["steady", "short", "brake", "apart"])
def test_nothing_is_told_where_the_torque_does_not_show(case: str) -> None:
    channels = recorded(wheel_speed=0.1)
    drive, wheel = channels["output_torque"], channels["wheel_speed"]
    noise = np.random.default_rng(5).normal(0.0, 20.0, TIME.size)
    match case:
        case "steady":
            drive = replace(drive, values=2000.0 + noise)
        case "short":
            drive = replace(drive, time=drive.time[:500], values=drive.values[:500])
        case "brake":
            wheel = replace(wheel, values=20.0 + 3.0 * np.sin(5.0 * TIME) + 1e-3 * noise)
        case _:
            wheel = replace(wheel, time=wheel.time + 100.0)
    assert estimate_torque_delay(drive, wheel) is None
    assert check_torque_delays({"wheel_speed": wheel}) == []
