# SPDX-License-Identifier: MIT
"""Moving means near the ends of a record, resolution, runs."""

from __future__ import annotations

import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin._util.signal_processing import (
    compute_moving_mean,
    estimate_resolution,
    estimate_rounding_step,
    find_large_steps,
    find_largest,
    find_true_runs,
    integrate_trapezoids,
    sample_blocks,
)


@pytest.mark.parametrize("width", [1, 2, 5, 9, 10, 30])
@pytest.mark.parametrize("size", [0, 1, 2, 3, 9, 20])
def test_a_constant_is_kept_up_to_both_ends(width: int, size: int) -> None:
    assert compute_moving_mean(np.full(size, 8e5), width) == pytest.approx(np.full(size, 8e5))


@pytest.mark.parametrize("width", [3, 5, 11, 41])
def test_a_ramp_is_kept_up_to_both_ends(width: int) -> None:
    ramp = np.linspace(-3.0, 7.0, 40)
    assert compute_moving_mean(ramp, width) == pytest.approx(ramp)


@pytest.mark.parametrize("width", [4, 5, 10])
def test_the_mean_is_that_of_the_samples_around(width: int) -> None:
    values = np.random.default_rng(1).normal(size=50)
    mean = compute_moving_mean(values, width)
    around = values[25 - width // 2 : 25 + (width - 1) // 2 + 1]
    assert around.size == width
    assert mean[25] == pytest.approx(around.mean())


def test_an_empty_record_has_an_empty_mean() -> None:
    assert compute_moving_mean(np.empty(0), 5).size == 0


def test_the_resolution_is_that_of_all_numbers_not_of_successive_ones() -> None:
    ramp = np.array([0.0, 3.0, 6.0, 4.0])
    assert estimate_resolution(ramp) == 1.0
    assert estimate_resolution(np.full(5, 2.0)) == 0.0
    assert estimate_resolution(np.array([0.1 + 0.2, 0.3, 0.3 + 1e-3])) == pytest.approx(1e-3)


def test_numbers_that_are_no_multiples_apart_have_a_resolution_but_no_rounding_step() -> None:
    values = np.random.default_rng(2).normal(size=100)
    assert estimate_resolution(values) > 0.0
    assert estimate_rounding_step(values) == 0.0
    assert estimate_rounding_step(0.5 * np.round(values / 0.5)) == pytest.approx(0.5)


def test_few_changes_show_no_rounding_step() -> None:
    values = np.repeat([0.0, 1.0, 0.0, 2.0], 20)
    assert estimate_resolution(values) == 1.0
    assert estimate_rounding_step(values) == 0.0


def test_true_runs_are_half_open() -> None:
    mask = np.array([True, True, False, True, False, False, True])
    assert find_true_runs(mask) == [(0, 2), (3, 4), (6, 7)]
    assert find_true_runs(np.zeros(3, np.bool_)) == []


@given(mask=st.lists(st.booleans(), max_size=40), least=st.integers(1, 4))
def test_true_runs_of_a_least_length_are_all_of_them(mask: list[bool], least: int) -> None:
    runs = find_true_runs(np.asarray(mask, np.bool_), least)
    edges = "".join("x" if one else " " for one in mask)
    assert runs == [found.span() for found in re.finditer("x+", edges) if len(found[0]) >= least]


def test_trapezoids_of_a_line_are_its_integral() -> None:
    time = np.array([0.0, 0.1, 0.5, 2.0])
    assert integrate_trapezoids(3.0 * time + 1.0, time) == pytest.approx(1.5 * time**2 + time)


@pytest.mark.parametrize("size", [0, 1, 2, 65535, 65536, 65537, 150_000])
def test_large_steps_are_found_across_the_parts_of_a_record(size: int) -> None:
    values = np.random.default_rng(size).standard_normal(size)
    expected = np.flatnonzero(np.abs(np.diff(values)) > 1.5)
    assert np.array_equal(find_large_steps(values, 1.5), expected)


def test_blocks_of_a_long_record_are_stretches_from_its_start_to_its_end() -> None:
    values = np.arange(300_000.0)
    blocks = sample_blocks(values)
    assert np.all(np.diff(blocks) == 1.0)
    assert (blocks[0, 0], blocks[-1, -1]) == (values[0], values[-1])
    assert np.array_equal(sample_blocks(values[:1000]), values[None, :1000])


def test_the_largest_magnitude_is_that_of_either_sign() -> None:
    assert find_largest(np.array([1.0, -3.0])) == 3.0
    assert find_largest(np.empty(0)) == 0.0
    assert np.isnan(find_largest(np.array([1.0, np.nan])))
