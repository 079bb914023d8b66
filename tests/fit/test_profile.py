# SPDX-License-Identifier: MIT
"""Intervals of numbers that a recording bounds on one side."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.fit.fixed_numbers import Tolerance
from drivetwin.fit.recording import Measured, Recording
from drivetwin.fit.unknown import Unknown
from drivetwin.modeling.model import Model
from drivetwin.modeling.model_components import Plates
from drivetwin.simulation.dual_clutch import Signal, Stribeck

TIME = np.linspace(0.0, 2.0, 2001)
TORQUE = np.interp(TIME, [0.0, 0.8, 0.95, 1.05, 1.2, 2.0], [20.0, 20.0, 39.5, 39.5, 20.0, 20.0])


def build_brake(mu: float) -> Model:
    model = Model("brake")
    model.torque("motor", "a", Signal(TIME, TORQUE))
    model.inertia("rotor", 1.0, "a")
    plates = Plates(Stribeck(mu, mu, 10.0, 0.0), gain=1.0, p0=0.0)
    pressure = Signal(TIME, np.full(TIME.size, 380.0))
    model.clutch("brake", "a", "ground", pressure=pressure, plates=plates)
    model.start({"a": 0.0}, locked=["brake"])
    return model


@pytest.mark.parametrize(("sigma", "is_bounded"), [(0.1, True), (0.9, False)])
def test_friction_of_a_brake_that_hardly_slips_is_bounded_below_alone(
    sigma: float, is_bounded: bool
) -> None:
    """Loud noise hides whether the brake slips, by 0.17 rad/s: it would hold with any larger
    friction. The expansion at the minimum promised a standard deviation of 2 %."""
    speed = build_brake(0.1).simulate(TIME)["speed", "a"]
    measured = speed + sigma * np.random.default_rng(2).standard_normal(TIME.size)
    model = build_brake(0.09)
    paths = ["brake.friction.mu_c", "brake.friction.mu_s"]
    found = model.fit(
        Recording({}, {"w": Measured(TIME, measured, sigma)}, {"a": 0.0}),
        {"mu": Unknown(0.095, 0.05, paths=paths)},
        {"w": ("speed", "a")},
        tolerances={one.name: Tolerance(exact=True) for one in model.components},
        seed=0,
    )
    low, high = found.intervals["mu"]
    assert 0.095 < low < 0.1 < high
    assert (high < 0.103) == is_bounded
    assert (high > 0.2) != is_bounded
