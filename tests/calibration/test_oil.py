# SPDX-License-Identifier: MIT
"""Friction over the oil temperature: law, draws, and the temperature of the twin's log."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.calibration.oil import OilFriction, OilState
from drivetwin.calibration.scenarios import TwinDraws
from drivetwin.calibration.spread import Spread
from drivetwin.calibration.twin_task import Request, build_task
from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import Stribeck
from drivetwin.twin.twin import build_nominal_shift
from tests.calibration.cases import make_upshift
from tests.calibration.twins import make_twin

REQUEST = Request(gears=("2", "3"), engine_torque=1400.0, engine_speed=185.0, system_pressure=1e6)
NONE = Spread(gain=0.0, engine_torque=0.0, contact_pressure=0.0, oil_temperature=0.0)


def get_level(model: object, element: int) -> float:
    law = model.elements[element].friction  # type: ignore[attr-defined]
    assert isinstance(law, Stribeck)
    return law.mu_c


def test_friction_falls_in_proportion_to_the_temperature() -> None:
    model = make_upshift().model
    hot = OilState(40.0, OilFriction(-2e-3, 0.0)).warm(model)
    for k in range(2):
        assert get_level(hot, k) == pytest.approx(0.92 * get_level(model, k))
    assert OilState().warm(model) == model


def test_the_slope_is_drawn_once_for_a_type_and_the_temperature_for_each_unit() -> None:
    twin = make_twin()
    shift = build_nominal_shift(twin, ("2", "3"))
    oil = OilState(40.0, OilFriction(-2e-3, 6e-4))
    draws = TwinDraws(replace(twin, covariance=None), shift, NONE, oil)
    random = np.random.default_rng(1)
    units = [draws(random) for _ in range(600)]
    levels = np.array([get_level(unit(random).model, 1) for unit in units if unit is not None])
    assert levels.std() / levels.mean() == pytest.approx(40.0 * 6e-4 / 0.92, rel=0.1)
    warm = replace(
        draws, spread=replace(NONE, oil_temperature=5.0), oil=OilState(0.0, OilFriction(-2e-3, 0.0))
    )
    unit = warm(random)
    assert unit is not None
    made = np.array([get_level(unit(random).model, 1) for _ in range(600)])
    assert made.std() / made.mean() == pytest.approx(5.0 * 2e-3, rel=0.1)


def test_a_temperature_needs_that_of_the_log() -> None:
    hot = replace(REQUEST, oil_temperature=380.0)
    with pytest.raises(InputError, match="which oil temperature"):
        build_task(make_twin(), hot)
    stated = replace(hot, oil=OilFriction(-1e-3, 0.0, log_temperature=350.0))
    twin = replace(make_twin(), validity={"oil_temperature": (340.0, 360.0)})
    of_log = replace(hot, oil=OilFriction(-1e-3, 0.0))
    cold = build_task(make_twin(), REQUEST).maneuver.model
    for task in (build_task(make_twin(), stated), build_task(twin, of_log)):
        assert get_level(task.maneuver.model, 0) == pytest.approx(0.97 * get_level(cold, 0))
        assert task.maneuver.point.oil_temperature == 380.0
