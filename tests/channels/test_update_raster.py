# SPDX-License-Identifier: MIT
"""Held signals: the update instants are found from the changes, through rounding and jitter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from drivetwin.channels.roles import Quantity
from drivetwin.channels.shiftlog import Channel
from tests.support.arrays import FloatArray

STEP = 1e-3


def channel(values: FloatArray, quantity: Quantity = Quantity.TORQUE) -> Channel:
    time = np.round(np.arange(values.size) * STEP, 3)
    return Channel("engine_torque", quantity, time, values, "EngTrq", "Nm", held=True)


def hold(updates: FloatArray, period: int, phase: int = 0) -> FloatArray:
    """Repeat each update for `period` samples; the first is already `phase` samples old."""
    return np.repeat(updates, period)[phase:]


def wave(count: int, rounding: float) -> FloatArray:
    k = np.arange(count)
    torque = 1000.0 + 300.0 * np.sin(0.05 * k) + 40.0 * np.sin(k)
    return np.asarray(rounding * np.round(torque / rounding), dtype=np.float64)


@given(period=st.integers(5, 40), data=st.data(), rounding=st.sampled_from([0.01, 1.0, 11.0, 25.0]))
def test_every_update_is_found_and_no_other_sample(
    period: int, data: st.DataObject, rounding: float
) -> None:
    phase = data.draw(st.integers(0, period - 1))
    updates = wave(150, rounding)
    fresh = channel(hold(updates, period, phase)).updates
    first = 0 if phase == 0 else 1
    expected = (np.arange(first, 150) * period - phase) * STEP
    assert fresh.time == pytest.approx(expected)
    assert fresh.values.tolist() == updates[first:].tolist()
    assert not fresh.held


def test_updates_that_repeat_the_value_are_fresh_too() -> None:
    updates = np.repeat(wave(40, 1.0), 3)  # two of three updates change nothing
    updates[::17] += 5.0
    fresh = channel(hold(updates, 10)).updates
    assert fresh.time == pytest.approx(np.arange(120) * 0.01)


def assert_within_a_sample(found: FloatArray, true: NDArray[np.floating]) -> None:
    """Off the logger's grid an update that changes nothing is placed to a sample."""
    assert found.shape == true.shape
    assert np.abs(found - true).max() < 1.01 * STEP
    assert np.mean(np.abs(found - true) < 1e-9) > 0.99


def test_message_jitter_of_a_sample_does_not_hide_the_raster() -> None:
    rng = np.random.default_rng(7)
    at = np.arange(200) * 10 + np.concatenate(([0], rng.integers(0, 2, 199)))
    values = np.repeat(wave(200, 0.01), np.diff(np.append(at, 2000)))
    assert_within_a_sample(channel(values).updates.time, at * STEP)


@given(st.integers(0, 1000), st.integers(10, 50), st.sampled_from([0.01, 11.0]))
def test_messages_that_jitter_by_several_samples_of_the_table_are_updates(
    seed: int, period: int, rounding: float
) -> None:
    """A bus in a fast table: each update shows up to a fifth of its period late."""
    rng = np.random.default_rng(seed)
    updates = wave(200, rounding)
    late = rng.integers(0, period // 5 + 1, 200)
    shown = np.searchsorted(period * np.arange(200) + late, np.arange(200 * period), "right")
    fresh = channel(updates[np.maximum(shown - 1, 0)]).updates
    assert abs(fresh.values.size - 200) <= 2
    near = np.abs(fresh.time[:, None] - STEP * (period * np.arange(200) + late)).argmin(axis=1)
    assert np.mean(fresh.values == updates[near]) > 0.97


@pytest.mark.parametrize(("length", "pause"), [(2, 20), (3, 35), (4, 45), (6, 55)])
def test_a_torque_that_changes_in_bursts_keeps_its_period_through_the_pauses(
    length: int, pause: int
) -> None:
    """Throttle steps without noise: jittering by a sample, 37 periods of 10.8 ms fit 40 of 10."""
    updates = np.full(51 + 7 * pause, 400.0)
    for step in range(7):
        start = 31 + pause * step
        updates[start:] += 20.0
        updates[start : start + length] -= 50.0 * np.exp(-np.arange(length))
    raster = channel(hold(updates, 10)).raster
    assert raster is not None
    assert raster.period == pytest.approx(0.01, rel=1e-6)


def test_stairs_of_a_rounded_ramp_are_no_updates() -> None:
    rate = 1.0 + 0.1 * np.sin(np.linspace(0.0, 30.0, 6000))
    ramp = np.cumsum(rate) / 20.0  # a stair about every 20 samples
    stairs = channel(np.round(ramp), Quantity.SPEED)
    assert stairs.updates.values.size == 6000


def test_clock_drift_does_not_add_up() -> None:
    at = np.ceil(np.arange(1000) * 10.004).astype(int)
    values = np.repeat(wave(1000, 0.01), np.diff(np.append(at, at[-1] + 10)))
    assert_within_a_sample(channel(values).updates.time, at * STEP)


@pytest.mark.parametrize("rounding", [0.01, 1.0, 25.0])
def test_a_signal_sampled_at_every_stamp_is_not_held(rounding: float) -> None:
    noise = np.random.default_rng(1).normal(0.0, 5.0, 2000)
    values = rounding * np.round((1000.0 + noise) / rounding)
    assert channel(values).raster is None


def test_a_coarse_slow_signal_without_raster_is_not_held() -> None:
    ramp = np.round(30.0 * np.sin(np.linspace(0.0, 2.0, 4000)) ** 2)
    assert channel(ramp).raster is None


def test_constants_and_states_are_not_held() -> None:
    assert channel(np.full(500, 7.0)).raster is None
    assert channel(hold(wave(50, 1.0), 10), Quantity.STATE).raster is None


def test_a_channel_that_is_not_held_stays_as_it_is() -> None:
    every = channel(np.random.default_rng(2).normal(size=100))
    assert every.updates is every


def test_a_hole_brings_no_update_and_hides_none() -> None:
    """Samples missing from the table: what changed in the hole has no stamp."""
    whole = channel(hold(wave(150, 1.0), 10))
    keep = (whole.time < 0.4535) | (whole.time > 0.5365)
    fresh = replace(whole, time=whole.time[keep], values=whole.values[keep]).updates
    expected = np.arange(150) * 0.01
    assert fresh.time == pytest.approx(expected[(expected < 0.4535) | (expected > 0.5365)])
    assert whole.raster is not None


def between(period: float, step: float, count: int, rounding: float) -> tuple[Channel, FloatArray]:
    """A signal of `period` in a table of `step`, and the instants at which it was updated."""
    at = np.asarray(1.3e-3 + period * np.arange(count), dtype=np.float64)
    time = np.asarray(np.round(np.arange(0.0, at[-1], step), 6), dtype=np.float64)
    values = wave(count, rounding)[np.clip(np.searchsorted(at, time, side="right") - 1, 0, None)]
    return replace(channel(values), time=time), at


@given(
    rates=st.sampled_from([(5, 2), (10, 4), (10, 3), (20, 8), (20, 6), (50, 20), (100, 8)]),
    rounding=st.sampled_from([0.01, 1.0, 11.0]),
)
def test_updates_between_the_samples_of_a_table_are_found(
    rates: tuple[int, int], rounding: float
) -> None:
    period, step = 1e-3 * rates[0], 1e-3 * rates[1]
    held, at = between(period, step, 300, rounding)
    fresh = held.updates
    assert np.abs(np.diff(fresh.time) - period).max() < 0.01 * period
    near = np.abs(fresh.time[:, None] - at).argmin(axis=1)
    assert np.all(np.diff(near) == 1)
    assert np.abs(fresh.time - at[near]).max() < 0.5 * step + 1e-6
    assert fresh.values.tolist() == wave(300, rounding)[near].tolist()


@given(st.integers(0, 1000), st.sampled_from([2e-3, 4e-3]))
def test_changes_by_chance_are_on_no_raster_between_samples(seed: int, step: float) -> None:
    gaps = np.random.default_rng(seed).integers(2, 6, 60)
    values = np.repeat(wave(60, 0.01), gaps)
    chance = channel(values)
    chance = replace(chance, time=np.round(np.arange(values.size) * step, 6))
    assert chance.raster is None


@given(st.integers(0, 740), st.integers(1, 400))
def test_a_gap_makes_no_two_updates_of_one(first: int, length: int) -> None:
    held, _ = between(10e-3, 4e-3, 300, 1.0)
    keep = np.ones(held.time.size, dtype=bool)
    keep[first : first + length] = False
    part = replace(held, time=held.time[keep], values=held.values[keep])
    if part.time.size > 100:
        assert np.all(np.diff(part.updates.time) > 0.5 * 10e-3)


@pytest.mark.parametrize("late", [0, 3])
def test_pauses_at_even_distances_are_no_raster(late: int) -> None:
    """Windows of 4 s around shifts, 30 s apart: a slow signal has changed when the next begins."""
    rng = np.random.default_rng(1)
    time = np.array([30.0 * k + 0.02 * j for k in range(20) for j in range(200)])
    window = np.arange(20).repeat(200)
    window[np.arange(4000) % 200 < late * (rng.random(20) < 0.2).repeat(200)] -= 1
    values = np.asarray(28.0 + 3.0 * window, dtype=np.float64)
    log = Channel("temperature.oil", Quantity.TEMPERATURE, time, values, "T_oil", "C")
    assert log.raster is None
    assert log.fresh.values.size == 4000
