# SPDX-License-Identifier: MIT
"""Promise: draws in two stages, its levels against a case with a known answer, and its shares."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import norm

from drivetwin.calibration.metrics import Metric, Outcome
from drivetwin.calibration.promise import TYPES, UNITS, compute_promise
from drivetwin.calibration.scenarios import Scenarios, TwinDraws, draw_types
from drivetwin.calibration.twin_task import Request, build_task
from tests.calibration.twins import make_twin
from tests.support.arrays import FloatArray

TYPE_COUNT, UNIT_COUNT = 3000, 200


def make_outcome(values: FloatArray) -> Outcome:
    none = np.zeros(values.size, np.bool_)
    return Outcome({Metric.PEAK_JERK: values}, values[:, None], none, none)


def test_the_promise_of_normal_stages_is_the_quantile_of_their_sum() -> None:
    random = np.random.default_rng(1)
    between, within = 3.0, 2.0
    types = np.repeat(random.normal(0.0, between, TYPE_COUNT), UNIT_COUNT)
    units = random.normal(0.0, within, types.size)
    sets = {"J1.inertia": types, "B2.gain": units, "start.engine": types + units}
    scenarios = Scenarios(sets, types.size)
    found = compute_promise(make_outcome(50.0 + types + units), scenarios, TYPE_COUNT, 0.9)
    expected = 50.0 + within * norm.ppf(0.95) + between * norm.ppf(0.9)
    assert found.levels[Metric.PEAK_JERK] == pytest.approx(expected, abs=0.4)  # 4 standard errors
    share = between**2 / (between**2 + within**2)
    assert found.shares[TYPES] == pytest.approx(share, abs=0.05)
    assert found.shares["J1"] == pytest.approx(share, abs=0.05)
    assert found.shares["B2"] == pytest.approx(1.0 - share, abs=0.05)
    assert found.shares[TYPES] + found.shares[UNITS] == pytest.approx(1.0)
    assert "start" not in found.shares


def test_an_element_without_effect_has_no_share() -> None:
    random = np.random.default_rng(2)
    values, idle = random.normal(size=(2, 2000))
    sets = {"J1.inertia": values, "B2.gain": idle}
    found = compute_promise(make_outcome(values), Scenarios(sets, 2000), 20, 0.9)
    assert found.shares["B2"] < 0.02
    assert found.shares["J1"] == pytest.approx(1.0, abs=0.01)


def test_types_share_the_random_numbers_of_their_units() -> None:
    request = Request(
        gears=("2", "3"), engine_torque=1400.0, engine_speed=185.0, system_pressure=1e6
    )
    task = build_task(make_twin(), request)
    assert isinstance(task.draw.driveline, TwinDraws)
    drawn = draw_types(task.maneuver, task.draw, 3, 40, 1)
    contact = drawn.sets["B2.p0"].reshape(3, 40)
    stiffness = drawn.sets["output shaft.stiffness"].reshape(3, 40)
    assert (stiffness == stiffness[:, :1]).all()
    assert len(set(stiffness[:, 0])) == 3
    spread = contact - contact[:, :1]
    assert spread[1] == pytest.approx(spread[0], abs=1e-6)
    assert spread.std() == pytest.approx(5e3, rel=0.3)
