# SPDX-License-Identifier: MIT
"""Recognition of channels that another tool filled up, and their measured samples."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy.interpolate import Akima1DInterpolator, CubicSpline, PchipInterpolator

from drivetwin.channels import knot_fit
from drivetwin.channels.roles import ReadOptions, TimeColumn
from drivetwin.logs.raw import RawChannel
from drivetwin.logs.read import read_raw
from tests.shifts.fixtures import shared
from tests.support.arrays import FloatArray
from tests.support.repeats import mark_repeats

STEP = 1e-3


def find_filling(time: FloatArray, values: FloatArray) -> Any:
    """Filling of a column of a file, None if it was measured at each row."""
    return RawChannel("n", "rpm", time, values).filling


NOISE = 0.3
FACTORS = (2, 3, 10, 20, 7.5)
KINDS = ("linear", "spline", "pchip", "makima")


def measure_speed(time: FloatArray, seed: int, noise: float = NOISE) -> FloatArray:
    """Return a speed [rpm] that falls in a shift and rings afterwards, with white noise."""
    level = 1500.0 + 60.0 * time - 250.0 / (1.0 + np.exp(-(time - 2.0) / 0.05))
    ring = 5.0 * np.exp(-np.clip(time - 2.2, 0.0, None) * 4.0) * np.sin(75.0 * time) * (time > 2.2)
    return level + ring + noise * np.random.default_rng(seed).standard_normal(time.size)


def fill(knots: FloatArray, values: FloatArray, kind: str, time: FloatArray) -> FloatArray:
    """Interpolate measured samples onto a faster table, with an interpolant of SciPy."""
    if kind == "linear":
        return np.interp(time, knots, values)
    if kind == "spline":
        return CubicSpline(knots, values)(time)
    if kind == "pchip":
        return PchipInterpolator(knots, values)(time)
    return Akima1DInterpolator(knots, values, method="makima")(time)


def check_filling(
    factor: float, kind: str, phase: float = 0.0, decimals: int = 6, seed: int = 0
) -> None:
    """Compare the knots that are found with those that were filled."""
    knots = np.arange(phase * STEP, 5.0, factor * STEP)
    values = measure_speed(knots, seed)
    time = np.arange(np.ceil(phase), 4900.0) * STEP
    found = find_filling(time, np.round(fill(knots, values, kind, time), decimals))
    assert found is not None
    assert found.interpolation.name == ("LINEAR" if kind == "linear" else "CUBIC")
    assert found.period == pytest.approx(factor * STEP, rel=1e-3)
    assert found.time.size == pytest.approx(4.9 / (factor * STEP), rel=0.02)
    # Instants and values: those that were measured, within what the rounding hides.
    truth = np.interp(found.time, knots, values)
    inner = slice(5, -5)
    assert np.std((found.values - truth)[inner]) < max(0.7 * 10.0**-decimals, 0.02 * NOISE)


@pytest.mark.parametrize(
    "filled",
    mark_repeats(product(FACTORS, KINDS), [*product(FACTORS, ["linear"]), *product([10], KINDS)]),
)
def test_finds_the_measured_samples(filled: tuple[float, str]) -> None:
    """Any ratio of rates, also one that does not divide."""
    check_filling(*filled)


@pytest.mark.parametrize("kind", ["linear", "spline", "pchip"])
def test_finds_knots_behind_rounding(kind: str) -> None:
    """Rounding after filling, to a third of the noise."""
    check_filling(10, kind, phase=3, decimals=1)


@pytest.mark.parametrize(
    ("factor", "phase"), [(2, 1.0), (5, 0.3), (8, 1.5), (10, 0.7), (12.5, 0.9), (25, 1.1)]
)
def test_finds_linear_knots_anywhere(factor: float, phase: float) -> None:
    """Knots between the samples of the table as well."""
    check_filling(factor, "linear", phase=phase, seed=1)


@pytest.mark.parametrize("digits", mark_repeats([5, 7, 9], [5]))
def test_a_text_of_significant_digits_is_no_filling(digits: int) -> None:
    """A simulation writes a smooth speed that starts at rest, so that its last decimal varies."""
    time = np.arange(0.0, 30.0, 1e-2)
    speed = 120.0 * (1.0 - np.exp(-0.2 * time)) + 0.3 * np.sin(7.0 * time) * np.exp(-0.3 * time)
    written = np.array([float(f"{one:.{digits}g}") for one in speed])
    assert find_filling(time, written) is None


@pytest.mark.parametrize("filled", [True, False])
def test_a_long_record_is_judged_like_a_short_one(filled: bool) -> None:
    """It has more distances than are looked at before all others."""
    time = np.arange(0.0, 60.0, STEP)
    knots = np.arange(0.0, 60.1, 7.5 * STEP)
    values = 300.0 * np.sin(0.3 * knots) + measure_speed(knots % 5.0, 2)
    record = fill(knots, values, "linear", time)
    record = record if filled else 300.0 * np.sin(0.3 * time) + measure_speed(time % 5.0, 2)
    found = find_filling(time, np.round(record, 6))
    assert (found is not None) is filled
    if found is not None:
        assert found.period == pytest.approx(7.5 * STEP, rel=1e-3)
        assert found.time.size == pytest.approx(60.0 / (7.5 * STEP), rel=0.02)


@given(
    seed=st.integers(0, 1000),
    step=st.sampled_from([0.0, 0.03, 0.3, 3.0]),
    rate=st.sampled_from([1, 10]),
)
@example(seed=111, step=3.0, rate=1)
def test_leaves_measured_samples_alone(seed: int, step: float, rate: int) -> None:
    """A channel that was sampled at each row, rounded or not."""
    time = np.arange(0.0, 5.0, rate * STEP)
    values = measure_speed(time, seed)
    values = np.round(values / step) * step if step else values
    assert find_filling(time, np.asarray(values)) is None


@pytest.mark.parametrize(
    ("decimals", "apart"), [(3, (3.0, 5.0)), (6, (4.0, 9.0)), (12, (8.0, 12.0))]
)
def test_finds_knots_of_messages_that_jitter(apart: tuple[float, float], decimals: int) -> None:
    """Messages arrive unevenly; lines meet where they arrived."""
    rng = np.random.default_rng(1)
    knots = np.cumsum(rng.uniform(*apart, 1700)) * STEP
    knots = knots[knots < 5.0]
    time = np.arange(0.01, 4.9, STEP)
    found = find_filling(time, np.round(np.interp(time, knots, measure_speed(knots, 3)), decimals))
    assert found is not None
    assert found.interpolation.name == "LINEAR"
    nearest = np.abs(found.time[1:-1, np.newaxis] - knots).min(axis=1)
    assert np.quantile(nearest, 0.95) < max(10.0**-decimals, 1e-12)


def test_names_a_filling_without_lines() -> None:
    """Of messages two to four rows apart too few straight parts are left to find the knots."""
    rng = np.random.default_rng(4)
    knots = np.cumsum(rng.uniform(2.0, 4.0, 1700)) * STEP
    time = np.arange(0.01, 4.9, STEP)
    found = find_filling(time, np.interp(time, knots, measure_speed(knots, 4)))
    assert found is not None
    assert found.interpolation.name == "UNKNOWN"
    assert found.time.size == 0


def test_names_a_filling_of_short_uneven_pieces() -> None:
    """Of messages about two rows apart few rows lie on a line, each of them exactly."""
    rng = np.random.default_rng(4)
    knots = np.cumsum(rng.uniform(1.2e-3, 2.9e-3, 2600))
    time = np.arange(0.01, 4.9, STEP)
    found = find_filling(time, np.interp(time, knots, measure_speed(knots, 4)))
    assert found is not None
    assert found.interpolation.name == "UNKNOWN"


@pytest.mark.parametrize(
    ("others", "decimals"), [((0.1,), 1), ((0.02, 0.007), 3), ((0.02, 0.025, 0.05, 0.1), 9)]
)
def test_finds_samples_among_the_stamps_of_other_messages(
    others: tuple[float, ...], decimals: int
) -> None:
    """A data frame on the union of all stamps, which messages of 10 ms and slower ones have."""
    rng = np.random.default_rng(8)
    rasters = [np.arange(0.3 * one, 5.0, one) for one in (0.01, *others)]
    stamps = [one + 3e-4 * rng.standard_normal(one.size) for one in rasters]
    knots = np.round(stamps[0], 6)
    time = np.unique(np.round(np.concatenate(stamps), 6))
    time = time[(time >= knots[0]) & (time <= knots[-1])]
    values = np.interp(time, knots, measure_speed(knots, 8, 1.0))
    found = find_filling(time, np.round(values, decimals))
    assert found is not None
    assert found.interpolation.name == "LINEAR"
    assert found.period == pytest.approx(0.01, rel=0.02)
    nearest = np.abs(found.time[:, np.newaxis] - knots).min(axis=1)
    assert np.mean(nearest < 1e-9) > (0.95 if decimals > 1 else 0.8)


TRUCK = "cases/real_truck"


@pytest.mark.parametrize("name", ["drive_0", "upshift_6_gear_1"])
def test_finds_messages_in_an_export_of_a_real_bus(name: str) -> None:
    """Speeds of a truck every 10 ms among the stamps of slower messages."""
    path = shared(f"{TRUCK}/{name}.csv")
    time = "Time" if "Time" in path.read_text(encoding="utf-8").partition("\n")[0] else None
    log = read_raw(path, ReadOptions(time=TimeColumn(time, None if time is None else "s")))
    for speed in ("TransInputShaftSpeed", "TransOutputShaftSpeed"):
        (channel,) = log.get_channels(speed)
        found = channel.filling
        assert found is not None
        assert found.interpolation.name == "LINEAR"
        assert found.period == pytest.approx(0.01, rel=0.01)
        assert np.isin(found.time, channel.time).all()
    (gear,) = log.get_channels("TransSelectedGear")
    assert gear.filling is None


@pytest.mark.parametrize(
    ("step", "late", "decimals"), [(1.0, 0.37, 9), (0.5, 0.12, 4), (2.0, 0.9, 6)]
)
def test_finds_the_updates_of_a_repeated_signal_behind_lines(
    step: float, late: float, decimals: int
) -> None:
    """A torque of 10 ms in a table of 1 ms, which a tool moved onto other stamps by lines."""
    updates = np.arange(0.0, 5.0, 0.01)
    torque = 11.0 * np.round(measure_speed(updates, 3, 20.0) / 11.0)
    rows = np.arange(0.0, 5.0, STEP)
    repeated = torque[np.searchsorted(updates, rows + 1e-9, side="right") - 1]
    time = np.arange(0.01, 4.9, step * STEP)
    found = find_filling(time, np.round(np.interp(time, rows + late * STEP, repeated), decimals))
    assert found is not None
    assert found.interpolation.name == "STEPS"
    assert found.period == pytest.approx(0.01, rel=1e-5)
    number = np.round((found.time - late * STEP) / 0.01).astype(int)
    assert np.array_equal(found.values, torque[number])
    assert np.abs(found.time - late * STEP - updates[number]).max() < 0.5 * step * STEP


@pytest.mark.parametrize("step", [0.5, 2.0])
@pytest.mark.parametrize("rate", [1, 10])
def test_rounding_makes_no_lines(step: float, rate: int) -> None:
    """A measured channel that is rounded about as coarsely as it is noisy bends at few points."""
    time = np.arange(0.0, 8.0, rate * STEP)
    for seed, noise in enumerate((0.1, 0.3, 1.0)):
        speed = measure_speed(time, seed, noise) + 5.0 * time**2
        values = np.round(speed / step) * step
        assert find_filling(time, np.asarray(values)) is None


def test_ramps_without_noise_are_not_filled() -> None:
    """A simulated record with straight parts, curves and corners."""
    time = np.arange(0.0, 6.0, STEP)
    ramps = np.interp(time, np.arange(7.0), [0.0, 90.0, 50.0, 150.0, 150.0, 20.0, 60.0])
    assert find_filling(time, ramps + np.where(time > 4.5, np.sin(9.0 * (time - 4.5)), 0.0)) is None


@pytest.mark.parametrize("slope", [0.0, 20.0, 1.0 / 3.0, 1e-9])
def test_a_line_is_not_filled(slope: float) -> None:
    """A record that is straight up to the round-off of its numbers."""
    time = np.round(np.arange(200) * 0.01, 2)
    assert find_filling(time, 800.0 + slope * time) is None


@pytest.mark.parametrize("value", [np.nan, 1e300])
def test_ignores_missing_and_damaged_values(value: float) -> None:
    """Rows without a value are no samples, nor are numbers whose square overflows."""
    knots = np.arange(0.0, 5.0, 0.01)
    time = np.arange(0.0, 4.9, STEP)
    values = np.interp(time, knots, measure_speed(knots, 5))
    values[1000:1100] = value
    found = find_filling(time, values)
    assert found is not None
    assert found.period == pytest.approx(0.01)
    assert (np.abs(found.values) < 1e6).all()


def test_steps_on_a_raster_are_no_knots() -> None:
    """A smooth channel without noise that answers to steps of its cause every 50 ms."""
    rng = np.random.default_rng(6)
    time = np.arange(0.0, 5.0, STEP)
    values = np.zeros(time.size)
    for at, size in zip(np.arange(0.0, 5.0, 0.05), rng.standard_normal(100), strict=True):
        after = np.clip(time - at, 0.0, None)
        values += size * (after - np.sin(30.0 * after) / 30.0)
    assert find_filling(time, np.round(values, 6)) is None


def test_a_pause_has_no_knot() -> None:
    """Two records with knots between rows, each filled up on its own."""
    rng = np.random.default_rng(0)
    stamps, filled = [], []
    for start, level in ((0.0, 1500.0), (60.0, 400.0)):
        knots = start + 0.01 * (np.arange(400) + rng.uniform(-0.1, 0.1, 400))
        time = start + np.arange(-0.02, 4.02, 0.002)
        stamps.append(time)
        filled.append(np.interp(time, knots, level + rng.normal(0.0, 5.0, 400)))
    found = find_filling(np.concatenate(stamps), np.concatenate(filled))
    assert found.time.size > 800
    assert np.all(np.abs(found.values - np.where(found.time < 30.0, 1500.0, 400.0)) < 25.0)


@given(
    values=st.lists(
        st.sampled_from([0.0, 1.0, 1e-310, 1e300, -1e300, 3.5, np.nan]), min_size=0, max_size=400
    ),
    start=st.integers(0, 3),
)
def test_any_record_ends_without_a_warning(values: list[float], start: int) -> None:
    """Records of rest, missing values and numbers at the ends of the scale."""
    time = STEP * np.arange(float(start), float(start + len(values)))
    found = find_filling(time, np.asarray(values))
    assert found is None or found.time.size == found.values.size


PARAMETERS = [(12, 13, 4, 17, 5), (214, 66, 27, 76, 105)]
"""Numbers of parameters that a tester asks for in turn."""


def count(size: int, step: float) -> FloatArray:
    """Return even stamps [s]."""
    return np.arange(size) * np.float64(step)


@pytest.mark.parametrize("numbers", PARAMETERS)
def test_numbers_that_are_sent_in_turn_are_not_filled(numbers: tuple[int, ...]) -> None:
    """Two knots in five samples, two unknowns each, and their start reproduce any five numbers."""
    values = np.tile(np.array(numbers, float), 60)
    assert find_filling(count(values.size, 0.02), values) is None


def test_readings_of_several_parameters_in_one_column_are_not_filled() -> None:
    index = np.arange(400)
    levels, phases = np.array([1450.0, 88.0, 40.0, 12.0, 260.0]), np.arange(5.0)
    values = (levels * (1.0 + 0.05 * np.sin(0.01 * index[:, None] + phases)))[index, index % 5]
    assert find_filling(count(400, 0.02), values) is None


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_knots_of_an_oscillation_that_repeats_exactly_are_found(noise: float) -> None:
    """A steady oscillation of 20 knots is no cycle of numbers."""
    knots = 0.01 * np.arange(400)
    random = np.random.default_rng(4)
    values = 100.0 * np.sin(2.0 * np.pi * 5.0 * knots) + random.normal(0.0, noise, knots.size)
    time = count(3990, 0.001)
    found = find_filling(time, np.interp(time, knots, values))
    assert found is not None
    assert found.interpolation.name == "LINEAR"
    assert found.period == pytest.approx(0.01)


def test_a_long_record_filled_by_lines_is_found_by_its_windows() -> None:
    """One of more rows than all the windows that are searched first."""
    knots = np.arange(0.0, 300.0, 0.01)
    values = np.round(100.0 * np.random.default_rng(1).standard_normal(knots.size), 3)
    time = np.round(np.arange(299_000) * STEP, 3)
    found = find_filling(time, np.round(np.interp(time, knots, values), 6))
    assert found is not None
    assert found.interpolation.name == "LINEAR"
    assert found.period == pytest.approx(0.01, rel=1e-6)


def test_no_knots_are_sought_under_a_noise_that_hides_them(monkeypatch: pytest.MonkeyPatch) -> None:
    """A profile of straight lines over 1.5 s at 100 Hz, measured with noise of three roundings."""
    rng = np.random.default_rng(9)
    time = np.linspace(0.0, 81.91, 8192)
    profile = np.interp(time, 1.5 * np.arange(60), rng.normal(15.0, 45.0, 60))
    values = np.round(profile + 0.3 * rng.standard_normal(time.size), 1)
    monkeypatch.setattr(knot_fit, "_refine_raster", lambda *_: pytest.fail("a search"))
    assert find_filling(time, np.asarray(values)) is None
