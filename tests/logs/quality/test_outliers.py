# SPDX-License-Identifier: MIT
"""Spikes, stuck and saturated signals are found; sound ones of any shape are left alone."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from drivetwin.findings import Code, render
from tests.logs.quality.one_channel import check
from tests.support.arrays import FloatArray

TIME = np.arange(0.0, 4.0, 0.002)


def speed(seed: int = 1, noise: float = 0.3) -> FloatArray:
    """An upshift: ramp, fall within 0.3 s, ramp; with noise."""
    fall = np.clip((TIME - 2.0) / 0.3, 0.0, 1.0)
    return (120.0 + 8.0 * TIME - 35.0 * fall) + np.random.default_rng(seed).normal(
        0.0, noise, TIME.size
    )


def torque() -> FloatArray:
    """A torque with hole, step and a lightly damped 12 Hz oscillation after lock-up."""
    after = np.clip(TIME - 2.3, 0.0, None)
    ring = np.where(after > 0.0, 900.0 * np.exp(-3.0 * after) * np.cos(75.0 * after), 0.0)
    hole = np.where((TIME > 1.8) & (TIME < 2.0), -1500.0, 0.0)
    return 2500.0 + hole + ring + np.random.default_rng(2).normal(0.0, 8.0, TIME.size)


def find(role: str, values: Any, time: Any = TIME) -> list[tuple[int, int]]:
    """Return the runs of samples that are left out of a channel."""
    return check(role, np.asarray(values, np.float64), time=time).left_out


@pytest.mark.parametrize("step", [1, 10])
def test_sound_signals_keep_all_samples(step: int) -> None:
    held = np.repeat(np.round(torque()[::10], -1), 10)
    for values in (torque(), np.round(torque(), -1), held):
        assert find("output_torque", values[::step], TIME[::step]) == []
    for noise in (0.0, 0.1, 0.3, 0.8):
        for values in (speed(2, noise), np.round(speed(3, noise))):
            assert find("input_speed", values[::step], TIME[::step]) == []


@pytest.mark.parametrize(("width", "height"), [(1, 60.0), (2, -120.0)])
def test_spikes_are_found_to_the_sample(width: int, height: float) -> None:
    values = speed()
    for start in (300, 1030, 1700):
        values[start : start + width] += height
    found = check("input_speed", values, time=TIME)
    assert found.left_out == [(start, start + width) for start in (300, 1030, 1700)]
    assert any("3 spikes left out, " in text for text in render(found.findings))


def test_the_code_of_spikes_is_left_out_beside_another() -> None:
    values = torque()
    runs = [(k, k + 1) for k in (300, 800, 1300, 1308, 1500, 1502)]
    for start, stop in runs:
        values[start:stop] = -6000.0  # not far beyond the largest torque
    assert check("output_torque", values, time=TIME).left_out == runs


@pytest.mark.parametrize(("height", "width"), [(3000.0, 4), (-700.0, 12)])
def test_a_torque_that_jumps_and_jumps_back_is_found(height: float, width: int) -> None:
    values = torque()
    for start in (300, 700, 1600):
        values[start : start + width] += height
    expected = [(start, start + width) for start in (300, 700, 1600)]
    assert find("output_torque", values) == expected


def test_a_torque_that_knocks_steps_or_stays_away_is_no_pulse() -> None:
    """Pulses that a driveline has: rounded ones, long ones, steps, codes to and fro."""
    knock = (
        2000.0
        * np.clip(np.cos(np.pi * (TIME - 1.0) / 0.02), 0.0, None)
        * (np.abs(TIME - 1.0) < 0.01)
    )
    long = np.where((TIME > 1.0) & (TIME < 1.04), 2000.0, 0.0)
    step = np.where(TIME > 1.0, 2000.0, 0.0)
    codes = 50.0 * np.round((torque() + 30.0 * np.sin(40.0 * TIME)) / 50.0)
    for values in (torque() + knock, torque() + long, torque() + step, codes):
        assert find("output_torque", values) == []


def test_a_stuck_signal_is_found_until_it_jumps() -> None:
    values = np.round(speed() * 8.0) / 8.0
    values[400:700] = values[400]
    found = check("input_speed", values, time=TIME)
    assert found.left_out == [(401, 700)]
    assert any("from 0.802 s to 1.398 s" in text for text in render(found.findings))
    fine = speed()
    fine[1500:] = fine[1500]
    assert find("input_speed", fine) == [(1501, TIME.size)]
    noisy = torque()
    noisy[600:650] = noisy[600]
    assert find("output_torque", noisy) == [(601, 650)]


def test_signals_that_may_rest() -> None:
    """A pressure without noise, standstill, a calculated course, a coarse signal."""
    pressure = np.where(TIME < 2.0, 14e5, 0.0)
    for values in (pressure, pressure + TIME):
        assert find("pressure.B2", values) == []
    rest = np.where((TIME > 1.0) & (TIME < 2.5), 40.0 * np.sin(2.0 * (TIME - 1.0)), 0.0)
    rest = 100.0 + np.where(TIME >= 2.5, 40.0 * np.sin(3.0), rest)
    settling = 100.0 + np.round(50.0 * np.exp(-8.0 * TIME), 6)
    steady = np.round(120.0 + 0.4 * TIME)
    started = np.clip(60.0 * (TIME - 1.0), 0.0, None)
    for values in (rest, settling, steady, started):
        assert find("input_speed", values) == []


def test_dropouts_to_zero_are_found() -> None:
    values = speed()
    values[400:407] = 0.0
    values[900] = 0.0
    assert find("input_speed", values) == [(400, 407), (900, 901)]
    # Out of a calm torque too, though the tip-in begins right after it.
    driven = np.where(TIME < 2.0, 400.0, np.minimum(400.0 + 4e3 * (TIME - 2.0), 1500.0))
    calm = driven + np.where(np.arange(TIME.size) % 7 == 0, 11.0, 0.0)
    assert find("engine_torque", calm) == []
    calm[980:996] = 0.0
    assert find("engine_torque", calm) == [(980, 996)]


def test_a_torque_that_truly_rests_at_zero_is_no_dropout() -> None:
    overrun = np.maximum(400.0 - 4e3 * np.clip(np.abs(TIME - 2.0) - 0.1, 0.0, None), 0.0)
    around_zero = np.round(np.random.default_rng(3).normal(0.0, 0.6, TIME.size)) * 20.0
    around_zero[-300:] = 400.0
    lasting = np.where((TIME > 1.0) & (TIME < 2.0), 0.0, 400.0)
    lasting[-300:] = 1500.0
    for values in (overrun, 400.0 - overrun, around_zero, lasting):
        assert find("engine_torque", values) == []


@pytest.mark.parametrize(("value", "width"), [(-9999.0, 5), (32767.0, 1), (8191.0, 40)])
@pytest.mark.parametrize("every", [1, 10])
def test_numbers_far_beyond_all_others_are_found(value: float, width: int, every: int) -> None:
    time, values = TIME[::every], torque()[::every]
    width = max(1, width // every)
    for start in (20, 120):
        values[start : start + width] = value
    assert find("output_torque", values, time) == [(start, start + width) for start in (20, 120)]


@pytest.mark.parametrize("value", [-9999.0, 8191.0])
def test_numbers_far_beyond_all_others_are_found_at_the_ends(value: float) -> None:
    """At the start nothing has been received yet."""
    values = np.round(torque() / 5.0)
    values[:100] = values[-70:] = value
    assert find("output_torque", values) == [(0, 100), (TIME.size - 70, TIME.size)]


@pytest.mark.parametrize("every", [1, 10])
@pytest.mark.parametrize("noise", [0.0, 0.03])
def test_a_fill_pulse_is_a_pressure(every: int, noise: float) -> None:
    """In bar: 6 for 120 ms, held at 0.9, raised to 2.5; and another that begins before the log."""
    time = np.linspace(0.0, 4.0, 4001)[::every]
    course = np.interp(time, [1.4, 2.0], [0.9, 2.5]) * (time >= 1.12)
    noisy = np.random.default_rng(5).normal(0.0, noise, time.size)
    filled = np.where((time >= 1.0) & (time < 1.12), 6.0, course) + noisy
    released = np.where(time < 0.2, 14.0, course) + noisy
    course += noisy
    for values in (filled, released):
        assert find("pressure.B2", 1e5 * values, time) == []
    # No value was there at rest, on the way up, or no such pressure exists.
    for moment, number in ((0.5, 65.5), (1.6, 65.5), (1.0, 655.0), (0.5, -9.0)):
        lost = (time >= moment) & (time < moment + 0.12)
        (run,) = find("pressure.B2", 1e5 * np.where(lost, number, course), time)
        assert np.flatnonzero(lost)[[0, -1]].tolist() == [run[0], run[1] - 1]


def test_a_large_torque_that_was_measured_is_not_beyond() -> None:
    """What moves, passes through the numbers between, lasts or is sampled slowly may be true."""
    coast = np.random.default_rng(4).normal(-40.0, 3.0, TIME.size)
    blip = (TIME > 2.0) & (TIME < 2.2)
    assert find("engine_torque", np.where(blip, coast + 400.0, coast)) == []
    passing = coast + np.clip(400.0 - 8e3 * np.abs(TIME - 2.0), 0.0, 300.0)
    assert find("engine_torque", passing) == []
    assert find("engine_torque", np.where(np.abs(TIME - 2.0) < 0.3, coast + 440.0, coast)) == []
    assert find("engine_torque", np.where(blip, 400.0, coast)[::50], TIME[::50]) == []


def test_saturation_is_found() -> None:
    values = np.minimum(torque(), 2900.0)
    found = check("output_torque", values, time=TIME)
    assert Code.SATURATED in [one.code for one in found.findings]
    at_limit = np.flatnonzero(values == 2900.0)
    left = [k for start, end in found.left_out for k in range(start, end)]
    assert set(left) <= set(at_limit.tolist())
    assert len(left) > 0.8 * at_limit.size


def rests(values: FloatArray) -> bool:
    """Return True if an engine torque is reported to stay at one number."""
    found = check("engine_torque", np.asarray(values, np.float64))
    return Code.AT_ONE_NUMBER in [one.code for one in found.findings]


@pytest.mark.parametrize("noise", [0.5, 0.8, 2.0])
def test_a_coarse_torque_that_rests_too_long_is_noticed(noise: float) -> None:
    values = 11.0 * np.round(72.2 + noise * np.random.default_rng(5).normal(size=800))
    assert not rests(values)
    values[200:320] = values[200]
    assert rests(values)


@given(noise=st.floats(0.05, 3.0), seed=st.integers(0, 1000), levels=st.integers(1, 5))
@example(noise=0.5, seed=402, levels=2)  # a step between two levels is no overflow
def test_rounding_alone_makes_no_stuck_torque(noise: float, seed: int, levels: int) -> None:
    """Steps between levels anywhere between two codes: where noise is small, some rest for long."""
    rng = np.random.default_rng(seed)
    level = np.repeat(rng.uniform(90.0, 120.0, levels), 1000 // levels)
    assert not rests(12.5 * np.round(level + noise * rng.normal(size=level.size)))
    assert not rests(np.repeat([200.0, 900.0, 500.0, 700.0, 300.0], 100))


def show_on(values: FloatArray, lost: list[int]) -> FloatArray:
    """The values as a logger shows them where the messages numbered `lost` did not come."""
    shown = values.copy()
    for k in lost:
        shown[k] = shown[k - 1]
    return shown


@given(noise=st.floats(0.01, 0.08), rounding=st.sampled_from([0.0, 0.1, 1.0]))
def test_a_value_shown_on_while_the_signal_moves_is_left_out(noise: float, rounding: float) -> None:
    time = np.linspace(0.0, 5.98, 300)
    moving = 120.0 + 41.3 * np.abs(time - 1.21) + np.random.default_rng(2).normal(0.0, noise, 300)
    values = np.asarray(np.round(moving / rounding) * rounding if rounding else moving, np.float64)
    found = check("engine_torque", show_on(values, [40, 90, 91]), time=time)
    if rounding == 1.0:  # steps of 0.83 rounded to 1: repeats are true
        assert found.left_out == []
    else:
        assert found.left_out == [(40, 41), (90, 92)]
        assert any("3 samples repeat the previous one" in one for one in render(found.findings))


def test_repeats_by_chance_are_kept() -> None:
    """Before the pedal sets off, and amid noise of the size of the steps."""
    noise = np.random.default_rng(3).normal(0.0, 2.0, 200)
    values = np.round(250.0 + noise + 35.0 * np.clip(np.arange(200) - 100, 0, 20), 1)
    values[98:102] = [251.5, 262.5, 262.5, 302.5]
    time = 0.01 * np.arange(400)
    assert find("engine_torque", values, time[:200]) == []
    noise = np.random.default_rng(4).normal(0.0, 0.0057, 400)
    values = np.round(160.0 + 0.0145 * np.arange(400) + noise, 6)
    values[198:202] = values[199] + np.array([-0.026, 0.0, 0.0, 0.028])
    assert find("wheel_speed", values, time) == []


def test_a_noisy_signal_is_cut_where_it_reached_the_ends_of_its_range_a_few_times() -> None:
    true = torque()
    values = np.clip(true, 1300.0, 2650.0)
    left_out = find("output_torque", values)
    cut = np.zeros(TIME.size, np.bool_)
    for start, end in left_out:
        cut[start:end] = True
    assert np.array_equal(cut, values != true)
    # A regulated pressure without noise rests at its largest number.
    pressure = 1.4e6 * (1.0 - np.exp(-np.clip(TIME - 1.0, 0.0, 2.0) / 0.05))
    assert find("pressure.B3", np.minimum(pressure, 1.39e6)) == []
