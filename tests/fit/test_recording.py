# SPDX-License-Identifier: MIT
"""Recordings made ready for a fit: common span, grid, noise of the sensors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.fit.recording import Measured, Recording, build_network_record
from drivetwin.simulation.dual_clutch import Signal
from tests.support.arrays import FloatArray

INPUT_TIME = np.arange(0.5, 4.0, 0.01)
OUTPUT_TIME = np.arange(0.0, 5.0, 0.01)


def noise(count: int, sigma: float, seed: int = 1) -> FloatArray:
    return np.asarray(sigma * np.random.default_rng(seed).standard_normal(count))


def make_recording() -> Recording:
    torque = 20.0 * np.sin(INPUT_TIME) + noise(INPUT_TIME.size, 0.4)
    speed = 50.0 + OUTPUT_TIME + noise(OUTPUT_TIME.size, 0.2, 2)
    return Recording({"T": Signal(INPUT_TIME, torque)}, {"w": Measured(OUTPUT_TIME, speed)})


def test_the_record_covers_what_all_channels_cover() -> None:
    record = build_network_record(make_recording(), ["w"], {})
    assert record.time[0] == pytest.approx(0.5)
    assert record.time[-1] == pytest.approx(INPUT_TIME[-1])
    assert record.size == record.measured.size == record.sigma.size
    assert np.all(np.diff(record.time) > 0.0)
    (out,) = record.outputs
    assert np.all(np.isin(record.time[out.place], OUTPUT_TIME))


def test_a_delay_needs_input_beyond_the_span() -> None:
    record = build_network_record(make_recording(), ["w"], {"T": 0.2})
    assert record.time[0] == pytest.approx(0.7)
    assert record.time[-1] == pytest.approx(INPUT_TIME[-1] - 0.2, abs=0.011)


def test_noise_is_estimated_unless_it_is_stated() -> None:
    recording = make_recording()
    record = build_network_record(recording, ["w"], {})
    assert record.sigma[0] == pytest.approx(0.2, rel=0.1)
    assert np.sqrt(record.input_variance["T"]) == pytest.approx(0.4, rel=0.1)
    stated = replace(recording, outputs={"w": replace(recording.outputs["w"], sigma=0.7)})
    assert build_network_record(stated, ["w"], {}).sigma[0] == 0.7


def test_rounding_counts_as_noise_and_a_constant_has_some() -> None:
    rounded = Measured(OUTPUT_TIME, np.round(3.0 * OUTPUT_TIME, 1))
    assert rounded.get_noise() == pytest.approx(0.1 / np.sqrt(12.0), rel=0.5)
    assert Measured(OUTPUT_TIME, np.ones(OUTPUT_TIME.size)).get_noise() > 0.0


def test_the_driving_input_and_its_rest_are_the_recorded_one() -> None:
    recording = make_recording()
    record = build_network_record(recording, ["w"], {})
    total = record.inputs["T"].values + record.held_back["T"]
    assert total == pytest.approx(recording.inputs["T"].values)
    exact = 20.0 * np.sin(INPUT_TIME)
    assert np.std(record.inputs["T"].values - exact) < 0.4


def test_samples_that_are_no_numbers_are_left_out() -> None:
    recording = make_recording()
    one = recording.outputs["w"]
    values = np.where((one.time > 1.0) & (one.time < 2.0), np.nan, one.values)
    record = build_network_record(
        replace(recording, outputs={"w": replace(one, values=values)}), ["w"], {}
    )
    whole = build_network_record(recording, ["w"], {})
    assert record.size == pytest.approx(whole.size - 99, abs=1)


def test_without_inputs_the_outputs_state_the_span() -> None:
    record = build_network_record(replace(make_recording(), inputs={}), ["w"], {})
    assert (record.time[0], record.time[-1]) == (OUTPUT_TIME[0], OUTPUT_TIME[-1])


def test_a_missing_output_and_a_short_one_are_named() -> None:
    recording = make_recording()
    with pytest.raises(InputError, match="the recording has no x"):
        build_network_record(recording, ["x"], {})
    late = replace(recording.outputs["w"], time=OUTPUT_TIME + 10.0)
    with pytest.raises(InputError, match=r"w: 0 samples from 0.500 to 3\.990 s, fewer than 20"):
        build_network_record(replace(recording, outputs={"w": late}), ["w"], {})
