# SPDX-License-Identifier: MIT
"""Damaged and implausible channels: the error names channel, place and remedy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.errors import DamagedChannelError, PlausibilityError, TimeError
from drivetwin.findings import Code, render
from tests.logs.quality.one_channel import check
from tests.support.arrays import FloatArray

TIME = np.round(np.arange(100) * 0.01, 2)
RPM = np.pi / 30.0


def ramp(low: float, high: float) -> FloatArray:
    return np.linspace(low, high, TIME.size)


def test_a_sound_channel_passes_unchanged() -> None:
    sound = ramp(100.0, 150.0)
    checked = check("input_speed", sound)
    assert checked.channel.values.tolist() == sound.tolist()
    assert checked.findings == ()


def test_time_must_increase() -> None:
    time = TIME.copy()
    time[40] = time[39]
    with pytest.raises(TimeError) as caught:
        check("input_speed", ramp(100, 150), time=time)
    assert "sample 40 repeats the stamp before it" in caught.value.what
    assert caught.value.where.time == 0.39
    rounded: FloatArray = np.repeat(np.linspace(0.0, 0.9, 10), 10)
    with pytest.raises(TimeError) as caught:
        check("input_speed", ramp(100, 150), time=rounded)
    assert "more decimals" in caught.value.remedy
    time[40] = 0.25
    with pytest.raises(TimeError, match=r"sample 40 lies 0\.14 s before the last"):
        check("input_speed", ramp(100, 150), time=time)
    time[40] = np.nan
    with pytest.raises(TimeError, match="sample 40 has no time stamp"):
        check("input_speed", ramp(100, 150), time=time)


def test_single_samples_without_number_are_left_out_and_told() -> None:
    values = ramp(100.0, 150.0)
    values[[10, 50, 51, 52]] = np.nan
    checked = check("input_speed", values)
    assert checked.channel.time.tolist() == np.delete(TIME, [10, 50, 51, 52]).tolist()
    assert np.isfinite(checked.channel.values).all()
    assert render(checked.findings) == (
        "channel 'X': 4 samples without a number left out, at 0.100 s, from 0.500 s to 0.520 s.",
    )


def test_runs_without_numbers_are_left_out_and_told_with_their_spans() -> None:
    values = ramp(100.0, 150.0)
    values[20:30] = np.nan
    values[60:66] = np.inf
    checked = check("input_speed", values)
    assert checked.channel.values.size == 84
    assert render(checked.findings) == (
        "channel 'X': 16 samples without a number left out, "
        "from 0.200 s to 0.290 s, from 0.600 s to 0.650 s.",
    )


def test_a_channel_that_lost_most_samples_is_refused() -> None:
    values = ramp(100.0, 150.0)
    values[20:80] = np.nan
    with pytest.raises(DamagedChannelError, match="only 40 of 100 samples hold a sound number"):
        check("input_speed", values)


def test_a_counter_that_starts_again_is_named() -> None:
    time = np.where(TIME < 0.5, TIME, TIME - 0.5)
    with pytest.raises(TimeError, match=r"lies 0\.49 s before") as caught:
        check("input_speed", ramp(100, 150), time=time)
    assert "a time counter that starts again after 0.49 s" in caught.value.remedy


@pytest.mark.parametrize(("factor", "unit"), [(1e3, "ms"), (1e12, "ps"), (1 / 60.0, None)])
def test_stamps_in_another_unit_than_seconds(factor: float, unit: str | None) -> None:
    if unit is None:
        check("input_speed", ramp(100, 150), time=TIME * factor)
        return
    with pytest.raises(TimeError, match="apart, no log of a shift does that") as caught:
        check("input_speed", ramp(100, 150), time=TIME * factor)
    assert f'time = {{ unit = "{unit}" }}' in caught.value.remedy


def test_a_speed_that_overflows_is_refused() -> None:
    values = ramp(100.0, 150.0)
    values[50:] -= 102.4
    with pytest.raises(DamagedChannelError, match=r"jumps from .* \(1 such jumps\)") as caught:
        check("input_speed", values)
    assert caught.value.where.time == 0.5


def test_too_few_samples() -> None:
    with pytest.raises(DamagedChannelError, match="only 5 samples"):
        check("input_speed", ramp(1, 2)[:5], time=TIME[:5])


@pytest.mark.parametrize(
    "role", ["input_speed", "output_speed", "wheel_speed", "output_torque", "engine_speed"]
)
def test_what_must_vary_may_not_be_constant(role: str) -> None:
    with pytest.raises(DamagedChannelError, match=f"constant throughout.*{role} must vary"):
        check(role, np.full(100, 100.0))


@pytest.mark.parametrize("role", ["engine_torque", "pressure.B2"])
def test_what_may_be_constant(role: str) -> None:
    check(role, np.full(100, 1500.0))


def test_a_pressure_of_zero_throughout_is_an_open_element() -> None:
    check("pressure.B2", np.zeros(100), "bar")


@pytest.mark.parametrize(
    ("role", "largest", "unit", "fits"),
    [
        ("pressure.B2", 14e5 * 1e5, "bar", "'Pa'"),  # Pa taken as bar
        ("pressure.B2", 1400e5, "bar", 'unit = "kPa"'),  # before hPa, of which 1.4 bar would follow
        (
            "pressure.B2",
            14.0,
            "Pa",
            'unit = "bar"',
        ),  # before kgf/cm², of which 13.7 bar would follow
        ("pressure.B2", 1400e5, "bar", "'kPa'"),
        ("pressure.B2", 200e5, "bar", "'psi'"),
        ("input_speed", 1800.0, "rad/s", "'rpm'"),
        ("input_speed", 180.0 * RPM, "rpm", "'rad/s'"),
        ("output_torque", 2.5e6, "kNm", "'Nm'"),
    ],
)
def test_a_wrong_unit_is_told_with_the_one_that_fits(
    role: str, largest: float, unit: str, fits: str
) -> None:
    with pytest.raises(PlausibilityError) as caught:
        check(role, ramp(0.5, 1.0) * largest, unit)
    assert f"with unit {unit!r}" in caught.value.what
    assert fits in caught.value.remedy
    assert f'channels.{role} = {{ source = "X", unit = ' in caught.value.remedy


def test_a_pressure_off_by_1e5_names_both_figures_in_bar() -> None:
    with pytest.raises(PlausibilityError) as caught:
        check("pressure.B2", ramp(0.0, 14e5 * 1e5), "bar")
    assert (
        caught.value.what
        == "largest pressure is 1\u202f400\u202f000 bar, above 100.0 bar, with unit 'bar'"
    )


def test_a_negative_speed_asks_for_the_sign() -> None:
    with pytest.raises(PlausibilityError, match="negative") as caught:
        check("wheel_speed", -ramp(10.0, 20.0))
    assert 'channels.wheel_speed = { source = "X", sign = -1 }' in caught.value.remedy
    check("wheel_speed", ramp(10.0, 20.0))


def test_a_gap_of_the_file_is_told() -> None:
    time = np.concatenate((TIME[:40], TIME[60:]))
    checked = check("input_speed", ramp(100, 150)[:80], time=time)
    assert render(checked.findings) == ("channel 'X': No samples from 0.390 s to 0.600 s.",)


def test_a_stamp_far_ahead_is_refused() -> None:
    time = np.concatenate((TIME[:-1], [1e6]))
    with pytest.raises(TimeError, match="time jumps ahead by 999999 s"):
        check("input_speed", ramp(100, 150), time=time)


def test_an_engine_torque_at_its_limit_is_told() -> None:
    values = np.minimum(ramp(100.0, 900.0), 700.0)
    (text,) = render(check("engine_torque", values).findings)
    assert "At its largest number, 700.0 Nm, for 25 % of the log" in text
    values = np.where(TIME < 0.6, -9999.0, ramp(100.0, 900.0))
    (text,) = render(check("engine_torque", values).findings)
    assert "At its largest number, −9\u202f999 Nm, for 60 % of the log" in text


def test_a_pedal_that_is_held_is_no_limit() -> None:
    """The torque is held at other numbers too, or its last code is crossed to and fro."""
    held = np.round(np.interp(TIME, [0.3, 0.5], [800.0, 900.0]))
    noisy = 5.0 * np.round(180.0 + np.random.default_rng(6).normal(0.0, 0.4, TIME.size))
    for values in (held, -held, noisy):
        assert check("engine_torque", values).findings == ()
    lost = np.where(TIME > 0.3, 8191.0, held)
    (text,) = render(check("engine_torque", lost).findings)
    assert "8\u202f191 Nm" in text


def test_suction_asks_for_the_sign() -> None:
    with pytest.raises(PlausibilityError, match=r"goes down to −14\.00 bar") as caught:
        check("pressure.B2", ramp(-14e5, 0.1e5), "bar")
    assert 'channels.pressure.B2 = { source = "X", sign = -1 }' in caught.value.remedy


@pytest.mark.parametrize("role", ["pressure.B3", "output_torque", "engine_torque"])
def test_a_number_that_overflows_is_refused(role: str) -> None:
    rng = np.random.default_rng(2)
    size = 1e6 if role.startswith("pressure") else 2000.0
    true = size * (0.5 + 0.4 * np.sin(np.linspace(0.0, 9.0, TIME.size)))
    true = true + 1e-3 * size * rng.normal(size=TIME.size)
    check(role, true)
    with pytest.raises(DamagedChannelError, match="as a number that overflows does"):
        check(role, np.mod(true, 0.7 * size))


def test_a_slowly_sampled_output_torque_may_fall_at_lock_up_and_swing_back() -> None:
    time = np.linspace(0.0, 1.18, 60)
    values = np.where(time < 0.6, 1000.0 + 1400.0 * time, 200.0 + 900.0 * (time - 0.6))
    check("output_torque", values, time=time)
    with pytest.raises(DamagedChannelError, match="as a number that overflows does"):
        check("engine_torque", values, time=time)


def test_an_electric_motor_turns_fast_and_changes_its_speed_fast() -> None:
    turning = np.where(TIME < 0.5, 1500.0, np.maximum(1500.0 - 7000.0 * (TIME - 0.5), 900.0))
    check("input_speed", turning, "rpm")
    with pytest.raises(DamagedChannelError, match="jumps from"):
        check("wheel_speed", turning - 800.0, "rpm")
    with pytest.raises(PlausibilityError, match="largest speed is") as caught:
        check("input_speed", turning, "rad/s")
    assert 'unit = "rpm"' in caught.value.remedy
    with pytest.raises(PlausibilityError, match="largest speed is"):
        check("input_speed", 2.0 * turning, "rpm")


def test_a_pedal_between_two_slow_samples_is_no_overflow() -> None:
    time = np.arange(0.0, 5.0, 0.1)
    torque = np.where(time < 2.45, 1000.0 - 160.0 * time, 2400.0 - 160.0 * time)
    assert check("engine_torque", torque, time=time).findings == ()
    with pytest.raises(DamagedChannelError, match="as a number that overflows does"):
        check("engine_torque", torque, time=0.1 * time)


def test_a_switched_pressure_does_not_overflow() -> None:
    values = np.where(np.arange(TIME.size) < TIME.size // 2, 14e5, 0.0)
    values = values + 4e3 * np.random.default_rng(1).normal(size=TIME.size)
    assert check("pressure.B2", values).findings == ()
    noise = 4e3 * np.random.default_rng(1).normal(size=TIME.size)
    assert check("pressure.B2", noise).findings == ()


def test_a_saturated_pressure_is_told() -> None:
    true = 8e5 + 4e3 * np.random.default_rng(1).normal(size=TIME.size)
    true = true + 3e5 * np.sin(np.linspace(0.0, 26.0, TIME.size))
    checked = check("pressure.B2", np.minimum(true, 9.9e5))
    assert any("at one number" in text for text in render(checked.findings))
    assert np.count_nonzero(checked.channel.values == 9.9e5) < 3


def test_a_channel_of_few_steps_is_told() -> None:
    rng = np.random.default_rng(1)
    true = (
        800.0 + 600.0 * np.sin(np.linspace(0.0, 9.0, TIME.size)) + 5.0 * rng.normal(size=TIME.size)
    )
    checked = check("engine_torque", 100.0 * np.round(true / 100.0))
    assert any(
        "in steps of 100.0 Nm, 7 % of its largest" in text for text in render(checked.findings)
    )
    fine = check("engine_torque", 12.5 * np.round(true / 12.5))
    switched = np.where(np.arange(TIME.size) < TIME.size // 2, 0.0, 9e5)
    for one in (fine, check("pressure.B2", switched)):
        assert Code.COARSE_RESOLUTION not in [found.code for found in one.findings]


def test_steep_ramps_between_exact_levels_are_no_coarse_steps() -> None:
    levels = np.array([600.0, 1710.0, 905.0, 1433.0, 702.0, 1251.0])
    corners = np.linspace(0.0, 1.0, levels.size)
    held = np.repeat(np.linspace(0.0, 1.0, 26), -(-TIME.size // 26))[: TIME.size]
    torque = np.interp(held, corners, levels)
    jumps = np.abs(np.diff(torque))
    assert jumps[jumps > 0.0].min() > 0.03 * levels.max()
    checked = check("engine_torque", torque)
    assert not any("in steps of" in text for text in render(checked.findings))


@pytest.mark.parametrize(("value", "words"), [(8191.0, "Far beyond"), (0.0, "Fell to zero")])
def test_all_samples_that_repeat_a_damaged_update_are_left_out(value: float, words: str) -> None:
    """Engine torque every 10 ms in a table of 1 ms."""
    time = np.round(np.arange(4000) * 0.001, 3)
    updates = np.round(400.0 + 30.0 * np.sin(time[::10] * 9.0))
    updates[150:152] = value
    checked = check("engine_torque", np.repeat(updates, 10), "Nm", time)
    assert checked.channel.time.tolist() == np.delete(time, np.s_[1500:1520]).tolist()
    assert len(render(checked.findings)) == 1
    assert words in render(checked.findings)[0]


@pytest.mark.parametrize("role", ["pressure.B2", "wheel_speed", "engine_torque"])
@pytest.mark.parametrize("value", [-9999.0, 8191.0, 655.35])
def test_numbers_that_stand_for_no_value_are_left_out(role: str, value: float) -> None:
    """A coarse signal of a bus, in bar, rad/s or N·m."""
    unit = 1e5 if role.startswith("pressure") else 1.0
    sound = np.round(9.0 + 5.0 * np.sin(6.0 * TIME), 1)
    put_in = (TIME > 0.395) & (TIME < 0.475)
    checked = check(role, unit * np.where(put_in, value, sound))
    assert checked.channel.values.tolist() == (unit * sound[~put_in]).tolist()
    assert render(checked.findings)[0].endswith(
        "Far beyond all other numbers from 0.400 s to 0.470 s, left out."
    )


def test_a_pulse_is_left_out_of_a_measured_torque_only() -> None:
    """An engine may be cut for 10 ms."""
    time = np.round(np.arange(2000) * 0.001, 3)
    values = 900.0 + 50.0 * np.sin(9.0 * time) + np.random.default_rng(4).normal(size=time.size)
    values[800:810] -= 700.0
    checked = check("output_torque", values, "Nm", time)
    assert checked.channel.time.tolist() == np.delete(time, np.s_[800:810]).tolist()
    assert "Jumped up or down and back from 0.800 s to 0.809 s" in render(checked.findings)[0]
    assert check("engine_torque", values, "Nm", time).findings == ()


def rows_of_messages(count: int = 400) -> tuple[FloatArray, FloatArray]:
    """Stamps of two messages every 20 ms, 2 ms apart; speed [rad/s] of the second, held."""
    sent = np.arange(count) * 0.02
    time = np.sort(np.concatenate((sent, sent + 0.002)))
    speed = RPM * np.interp(sent, [3.0, 3.5], [2600.0, 1300.0])
    speed += 0.05 * np.sin(17.0 * sent)
    return np.round(time, 3), np.concatenate((speed[:1], np.repeat(speed, 2)[:-1]))


@given(
    lost=st.integers(9, 12),
    first=st.integers(151, 162),
    role=st.sampled_from(["input_speed", "engine_speed"]),
)
def test_a_burst_of_lost_messages_is_left_out(lost: int, first: int, role: str) -> None:
    time, speed = rows_of_messages()
    start, end = 2 * first + 1, 2 * (first + lost) + 1
    speed[start:end] = speed[start - 1]
    checked = check(role, speed, time=time)
    left = np.isin(time, checked.channel.time)
    assert not left[start:end].any()
    assert left[: start - 2].all()
    assert left[end:].all()
    codes = {one.code for one in checked.findings} - {Code.NO_SAMPLES, Code.TABLE_ROWS_COARSE}
    assert codes <= {Code.MESSAGES_LOST, Code.STUCK}
    assert codes


def test_a_slow_message_in_a_fast_table_is_no_burst() -> None:
    time = np.round(np.arange(4000) * 0.001, 3)
    sent = 150.0 + 60.0 * np.sin(np.arange(100) * 0.9)
    checked = check("input_speed", np.repeat(sent, 40), time=time)
    assert checked.channel.time.size == 4000
    assert checked.findings == ()


@pytest.mark.parametrize("size", [102.4, -102.4])
def test_a_speed_with_an_overflow_is_refused(size: float) -> None:
    time = np.round(np.arange(400) * 0.01, 2)
    speed = np.linspace(150.0, 170.0, 400)
    speed[200:] += size
    with pytest.raises(DamagedChannelError, match=r"jumps from .* \(1 such jumps\)") as caught:
        check("input_speed", speed, time=time)
    assert caught.value.where.time == 2.0


@pytest.mark.parametrize("places", [[500], [0], [1998], [100, 1700]])
def test_few_repeated_stamps_are_left_out(places: list[int]) -> None:
    time = np.round(np.arange(2000) * 0.01, 2)
    time[np.array(places) + 1] = time[places]
    speed = np.linspace(100.0, 150.0, 2000)
    checked = check("input_speed", speed, time=time)
    assert checked.channel.time.tolist() == np.unique(time).tolist()
    (found,) = [one for one in checked.findings if one.code is not Code.NO_SAMPLES]
    assert found.code is Code.STAMPS_REPEATED
    assert found.numbers["samples"].value == len(places)


def test_many_repeated_stamps_are_refused() -> None:
    time = np.round(np.arange(2000) * 0.01, 2)
    time[101:2000:300] = time[100:1999:300]
    with pytest.raises(TimeError, match="repeats the stamp before it"):
        check("input_speed", np.linspace(100.0, 150.0, 2000), time=time)
