# SPDX-License-Identifier: MIT
"""Spikes, stuck and saturated signals are found; sound ones of any shape are left alone."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin._util.signal_processing import find_true_runs
from drivetwin.channels.roles import Quantity
from drivetwin.errors import Where
from drivetwin.findings import Code
from drivetwin.logs.quality.outliers import (
    detect_quantization,
    find_clipping,
    find_dropouts,
    find_glitches,
    find_longest_rest,
    find_missing,
    find_outliers,
    find_spikes,
    find_stale,
    find_stuck,
)
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


@pytest.mark.parametrize("quantity", [Quantity.SPEED, Quantity.TORQUE])
@pytest.mark.parametrize("step", [1, 5, 10])
def test_sound_signals_have_no_spikes(quantity: Quantity, step: int) -> None:
    for values in (speed(), torque(), np.round(speed()), np.round(torque(), -1)):
        assert find_spikes(TIME[::step], values[::step], quantity) is None


def test_a_held_signal_has_no_spikes() -> None:
    held = np.repeat(np.round(torque()[::10], -1), 10)
    assert find_spikes(TIME, held, Quantity.TORQUE) is None


@pytest.mark.parametrize("width", [1, 2])
@pytest.mark.parametrize("height", [60.0, -120.0])
def test_spikes_are_found_to_the_sample(width: int, height: float) -> None:
    values = speed()
    for start in (300, 1030, 1700):
        values[start : start + width] += height
    found = find_spikes(TIME, values, Quantity.SPEED)
    assert found is not None
    assert find_true_runs(found.mask) == [(start, start + width) for start in (300, 1030, 1700)]
    assert "3 spikes left out, " in found.report(TIME, Where()).text


def test_torque_may_move_for_longer_than_a_spike() -> None:
    time = TIME * 10.0  # 20 ms: one sample of torque reduction is no spike
    values = torque()
    values[300] -= 2000.0
    assert find_spikes(time, values, Quantity.TORQUE) is None


@pytest.mark.parametrize("height", [3000.0, -700.0])
@pytest.mark.parametrize("width", [4, 12])
def test_a_torque_that_jumps_and_jumps_back_is_found(height: float, width: int) -> None:
    values = torque()
    for start in (300, 700, 1600):
        values[start : start + width] += height
    found = find_glitches(TIME, values)
    assert found is not None
    assert find_true_runs(found.mask) == [(start, start + width) for start in (300, 700, 1600)]


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
    for values in (torque(), torque() + knock, torque() + long, torque() + step, codes):
        assert find_glitches(TIME, values) is None


def test_a_stuck_signal_is_found_until_it_jumps() -> None:
    values = np.round(speed() * 8.0) / 8.0
    values[400:700] = values[400]
    found = find_stuck(TIME, values, Quantity.SPEED)
    assert found is not None
    assert find_true_runs(found.mask) == [(401, 700)]
    assert "from 0.802 s to 1.398 s" in found.report(TIME, Where()).text


def test_a_fine_signal_that_stays_to_the_end_is_stuck() -> None:
    values = speed()
    values[1500:] = values[1500]
    found = find_stuck(TIME, values, Quantity.SPEED)
    assert found is not None
    assert find_true_runs(found.mask) == [(1501, TIME.size)]


def test_a_noisy_torque_that_rests_shortly_is_stuck() -> None:
    values = torque()
    values[600:650] = values[600]
    found = find_stuck(TIME, values, Quantity.TORQUE)
    assert found is not None
    assert find_true_runs(found.mask) == [(601, 650)]


def test_a_pressure_without_noise_may_rest_and_fall_at_once() -> None:
    values = np.where(TIME < 2.0, 14e5, 0.0)
    assert find_stuck(TIME, values + TIME, Quantity.PRESSURE) is None
    assert find_stuck(TIME, values, Quantity.PRESSURE) is None


def test_dropouts_to_zero_are_found() -> None:
    values = speed()
    values[400:407] = 0.0
    values[900] = 0.0
    found = find_dropouts(TIME, values)
    assert found is not None
    assert find_true_runs(found.mask) == [(400, 407), (900, 901)]
    assert find_dropouts(TIME, np.where(TIME < 1.0, 0.0, 40.0 * (TIME - 1.0))) is None
    assert find_dropouts(TIME, speed()) is None


def test_a_short_dropout_out_of_a_calm_torque_is_found() -> None:
    """The tip-in begins right after it."""
    driven = np.where(TIME < 2.0, 400.0, np.minimum(400.0 + 4e3 * (TIME - 2.0), 1500.0))
    values = driven + np.where(np.arange(TIME.size) % 7 == 0, 11.0, 0.0)
    sound = values.copy()
    values[980:996] = 0.0
    found = find_dropouts(TIME, values)
    assert found is not None
    assert find_true_runs(found.mask) == [(980, 996)]
    assert find_dropouts(TIME, sound) is None


def test_a_torque_that_truly_rests_at_zero_is_no_dropout() -> None:
    overrun = np.maximum(400.0 - 4e3 * np.clip(np.abs(TIME - 2.0) - 0.1, 0.0, None), 0.0)
    around_zero = np.round(np.random.default_rng(3).normal(0.0, 0.6, TIME.size)) * 20.0
    around_zero[-300:] = 400.0
    lasting = np.where((TIME > 1.0) & (TIME < 2.0), 0.0, 400.0)
    lasting[-300:] = 1500.0
    for values in (overrun, 400.0 - overrun, around_zero, lasting):
        assert find_dropouts(TIME, values) is None


@pytest.mark.parametrize(("value", "width"), [(-9999.0, 5), (32767.0, 1), (8191.0, 40)])
@pytest.mark.parametrize("every", [1, 5, 10])
def test_numbers_far_beyond_all_others_are_found(value: float, width: int, every: int) -> None:
    time, values = TIME[::every], torque()[::every]
    width = max(1, width // every)
    for start in (20, 120):
        values[start : start + width] = value
    found = find_outliers(time, values)
    assert found is not None
    assert find_true_runs(found.mask) == [(start, start + width) for start in (20, 120)]
    assert found.code is Code.OUTLIERS


@pytest.mark.parametrize("value", [-9999.0, 8191.0])
def test_numbers_far_beyond_all_others_are_found_at_the_ends(value: float) -> None:
    """At the start nothing has been received yet."""
    values = np.round(torque() / 5.0)
    values[:100] = values[-70:] = value
    found = find_outliers(TIME, values)
    assert found is not None
    assert find_true_runs(found.mask) == [(0, 100), (TIME.size - 70, TIME.size)]
    released = np.where(TIME < 0.3, 14.0, np.round(5.0 * np.sin(TIME), 1))
    assert find_outliers(TIME, released) is None


@pytest.mark.parametrize("every", [1, 10])
@pytest.mark.parametrize("noise", [0.0, 0.03])
def test_a_fill_pulse_is_a_pressure(every: int, noise: float) -> None:
    """In bar: 6 for 120 ms, held at 0.9, raised to 2.5; and another that begins before the log."""
    time = np.linspace(0.0, 4.0, 4001)[::every]
    course = np.interp(time, [1.4, 2.0], [0.9, 2.5]) * (time >= 1.12)
    course += np.random.default_rng(5).normal(0.0, noise, time.size)
    filled = np.where((time >= 1.0) & (time < 1.12), 6.0, course)
    assert find_outliers(time, filled, possible=100.0) is None
    released = np.where(time < 0.2, 14.0, course)
    assert find_outliers(time, released, possible=100.0) is None
    # No value was there at rest, on the way up, or no such pressure exists.
    for moment, number in ((0.5, 65.5), (1.6, 65.5), (1.0, 655.0), (0.5, -9.0)):
        lost = (time >= moment) & (time < moment + 0.12)
        found = find_outliers(time, np.where(lost, number, course), possible=100.0)
        assert found is not None
        assert found.mask.tolist() == lost.tolist()


def test_a_large_torque_that_was_measured_is_not_beyond() -> None:
    """What moves, passes through the numbers between, lasts or is sampled slowly may be true."""
    coast = np.random.default_rng(4).normal(-40.0, 3.0, TIME.size)
    blip = (TIME > 2.0) & (TIME < 2.2)
    assert find_outliers(TIME, torque()) is None
    assert find_outliers(TIME, np.where(blip, coast + 400.0, coast)) is None
    assert (
        find_outliers(TIME, coast + np.clip(400.0 - 8e3 * np.abs(TIME - 2.0), 0.0, 300.0)) is None
    )
    assert find_outliers(TIME, np.where(np.abs(TIME - 2.0) < 0.3, 400.0, coast)) is None
    assert find_outliers(TIME[::50], np.where(blip, 400.0, coast)[::50]) is None
    assert find_outliers(TIME, np.where(blip, 400.0, 100.0)) is None


@pytest.mark.parametrize("start", [0, 600])
def test_a_number_that_the_signal_jumped_to_is_stuck_from_its_first_sample(start: int) -> None:
    values = torque()
    values[start : start + 50] = -9999.0
    found = find_stuck(TIME, values, Quantity.TORQUE)
    assert found is not None
    assert find_true_runs(found.mask) == [(start, start + 50)]


def test_a_coarse_signal_in_steady_driving_is_not_stuck() -> None:
    values = np.round(120.0 + 0.4 * TIME)
    assert find_stuck(TIME, values, Quantity.SPEED) is None
    assert find_stuck(TIME, np.zeros(TIME.size), Quantity.SPEED) is None


def test_a_signal_without_noise_may_rest() -> None:
    rest = np.where((TIME > 1.0) & (TIME < 2.5), 40.0 * np.sin(2.0 * (TIME - 1.0)), 0.0)
    rest = 100.0 + np.where(TIME >= 2.5, 40.0 * np.sin(3.0), rest)
    settling = 100.0 + np.round(50.0 * np.exp(-8.0 * TIME), 6)
    for values in (rest, settling):
        assert find_stuck(TIME, values, Quantity.SPEED) is None


def test_standstill_is_not_stuck() -> None:
    values = np.where(TIME < 1.0, 0.0, speed())
    assert find_stuck(TIME, values, Quantity.SPEED) is None


def test_saturation_is_found() -> None:
    values = np.minimum(torque(), 2900.0)
    found = find_clipping(values)
    assert found is not None
    assert np.array_equal(found.mask, _rests(values == 2900.0))
    assert found.code is Code.SATURATED
    assert find_clipping(torque()) is None
    assert find_clipping(np.round(torque(), -1)) is None


def _rests(mask: np.typing.NDArray[np.bool_]) -> np.typing.NDArray[np.bool_]:
    """Only stretches of three or more."""
    kept = np.zeros(mask.size, np.bool_)
    for start, end in find_true_runs(mask):
        kept[start:end] = end - start >= 3
    return kept


def test_missing_numbers_are_told_by_span() -> None:
    values = speed()
    values[100:200] = np.nan
    found = find_missing(values)
    assert found is not None
    assert "from 0.200 s to 0.398 s" in found.report(TIME, Where()).text


def test_late_times_are_told_to_the_millisecond() -> None:
    values = speed()
    values[100:200] = np.nan
    found = find_missing(values)
    assert found is not None
    assert "from 123456.200 s to 123456.398 s" in found.report(TIME + 123456.0, Where()).text


@given(st.lists(st.booleans(), max_size=60))
def test_runs_cover_exactly_what_is_true(flags: list[bool]) -> None:
    mask = np.array(flags, np.bool_)
    rebuilt = np.zeros(mask.size, np.bool_)
    for start, end in find_true_runs(mask):
        assert start < end
        rebuilt[start:end] = True
    assert np.array_equal(rebuilt, mask)


@pytest.mark.parametrize("noise", [0.5, 0.8, 2.0])
def test_a_coarse_torque_that_rests_too_long_is_noticed(noise: float) -> None:
    rng = np.random.default_rng(5)
    time = np.linspace(0.0, 7.99, 800)
    values = 11.0 * np.round(72.2 + noise * rng.normal(size=800))
    assert find_longest_rest(time, values) is None
    values[200:320] = values[200]
    span = find_longest_rest(time, values)
    assert span is not None
    assert abs(span[0] - 2.0) < 0.06
    assert abs(span[1] - 3.2) < 0.06


@given(noise=st.floats(0.05, 3.0), seed=st.integers(0, 1000), levels=st.integers(1, 5))
def test_rounding_alone_makes_no_stuck_torque(noise: float, seed: int, levels: int) -> None:
    """Steps between levels anywhere between two codes: where noise is small, some rest for long."""
    rng = np.random.default_rng(seed)
    level = np.repeat(rng.uniform(50.0, 150.0, levels), 1000 // levels)
    values = np.asarray(12.5 * np.round(level + noise * rng.normal(size=level.size)), np.float64)
    assert find_longest_rest(np.linspace(0.0, 9.99, level.size), values) is None


def test_a_calculated_torque_without_jitter_may_rest() -> None:
    time = np.linspace(0.0, 4.99, 500)
    steps = np.repeat([200.0, 900.0, 500.0, 700.0, 300.0], 100)
    assert find_longest_rest(time, steps) is None


def test_a_signal_in_stairs_has_less_noise_than_its_rounding() -> None:
    rough, calm = speed(noise=0.8), speed(noise=0.1)
    assert detect_quantization(np.round(calm)) == 1.0
    assert detect_quantization(np.round(rough)) == 0.0
    assert detect_quantization(calm) == 0.0
    assert detect_quantization(speed(noise=0.0)) == 0.0


def shown_on(values: FloatArray, lost: list[int]) -> FloatArray:
    """The values as a logger shows them where the messages numbered `lost` did not come."""
    shown = values.copy()
    for k in lost:
        shown[k] = shown[k - 1]
    return shown


@given(noise=st.floats(0.01, 0.08), rounding=st.sampled_from([0.0, 0.1, 1.0]))
def test_a_value_shown_on_while_the_signal_moves_is_left_out(noise: float, rounding: float) -> None:
    time = np.linspace(0.0, 5.98, 300)
    moving = 120.0 + 41.3 * np.abs(time - 1.21) + np.random.default_rng(2).normal(0.0, noise, 300)
    moving[200:] = moving[199]  # at rest nothing tells
    values = np.asarray(np.round(moving / rounding) * rounding if rounding else moving, np.float64)
    found = find_stale(shown_on(values, [40, 90, 91, 250]))
    if rounding == 1.0:  # steps of 0.83 rounded to 1: repeats are true
        assert found is None
    else:
        assert found is not None
        assert np.flatnonzero(found.mask).tolist() == [40, 90, 91]
        assert found.report(TIME, Where()).text.startswith("3 samples repeat the previous one")


@pytest.mark.parametrize("seed", range(5))
def test_sound_signals_show_no_value_on(seed: int) -> None:
    for values in (speed(seed), speed(seed, 0.0), torque(), np.round(speed(seed)), np.round(TIME)):
        assert find_stale(values) is None


def test_a_torque_that_sets_off_may_repeat_a_number_just_before() -> None:
    """Noise gives a step, a repeat by chance, and then the pedal: nothing is made up for."""
    noise = np.random.default_rng(3).normal(0.0, 2.0, 200)
    values = np.round(250.0 + noise + 35.0 * np.clip(np.arange(200) - 100, 0, 20), 1)
    values[98:102] = [251.5, 262.5, 262.5, 302.5]
    assert find_stale(np.asarray(values, np.float64)) is None


def test_a_repeat_by_chance_amid_noise_is_none() -> None:
    """A wheel speed [rpm] that rises by 0.014 a sample under noise of 0.006."""
    noise = np.random.default_rng(4).normal(0.0, 0.0057, 400)
    values = np.round(160.0 + 0.0145 * np.arange(400) + noise, 6)
    values[198:202] = values[199] + np.array([-0.026, 0.0, 0.0, 0.028])
    assert find_stale(np.asarray(values, np.float64)) is None
