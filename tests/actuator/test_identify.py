# SPDX-License-Identifier: MIT
"""Identification of made actuators: values, intervals, what a record does not determine."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.actuator import list_errors, make_actuator, record
from drivetwin.actuator.identify import (
    PressureRecord,
    identify_actuator,
)
from drivetwin.actuator.model import QUANTITIES, HeldSignal
from drivetwin.errors import IdentificationError
from tests.support.repeats import mark_repeats

NAMES = list(QUANTITIES)


@pytest.mark.parametrize("seed", mark_repeats([1, 2, 3], [1]))
def test_a_made_actuator_is_found_within_its_intervals(seed: int) -> None:
    random = np.random.default_rng([7, seed])
    actuator = make_actuator(random)
    found = identify_actuator([record(actuator, random)])
    errors, covered = list_errors(found, actuator.model)
    assert abs(errors[NAMES.index("dead_time")]) < 5e-3
    kiss = NAMES.index("kiss_pressure")
    assert abs(errors[kiss]) < 0.02 * actuator.model.kiss_pressure
    assert (np.abs(errors) < 4.5 * found.std).all()
    assert covered.sum() >= 4
    assert found.rms == pytest.approx(7e3, rel=0.1)


def test_without_noise_the_values_are_exact() -> None:
    random = np.random.default_rng(5)
    actuator = make_actuator(random)
    clean = record(actuator, random)
    exact = replace(clean, pressure=actuator.compute_pressure(clean.time))
    found = identify_actuator([exact])
    assert found.model.values == pytest.approx(actuator.model.values, rel=1e-3, abs=1e-5)


def test_an_opening_alone_leaves_the_fill_undetermined() -> None:
    random = np.random.default_rng(6)
    made = record(make_actuator(random), random)
    after = made.time > 3.4
    one = PressureRecord(
        HeldSignal(made.command.time[340:], made.command.values[340:]),
        made.time[after],
        made.pressure[after],
    )
    found = identify_actuator([one], expected_kiss=1.1e5)
    std = dict(zip(NAMES, found.std, strict=True))
    assert all(np.isinf(std[name]) for name in ("rising_lag", "kiss_pressure", "fill_time"))
    assert std["dead_time"] < 2e-3
    assert found.model.kiss_pressure == 1.1e5
    assert found.model.fill_time == 0.0
    assert found.model.rising_lag == found.model.falling_lag


def test_a_command_at_rest_is_refused() -> None:
    random = np.random.default_rng(8)
    made = record(make_actuator(random), random)
    still = replace(made, command=HeldSignal(np.array([0.0]), np.array([0.0])))
    with pytest.raises(IdentificationError, match="the command changes by less than"):
        identify_actuator([still])


def test_a_pressure_of_another_clutch_is_refused() -> None:
    random = np.random.default_rng(9)
    made = record(make_actuator(random), random)
    other = replace(made, pressure=made.pressure[::-1].copy())
    with pytest.raises(IdentificationError, match="does not follow its command"):
        identify_actuator([other])
