# SPDX-License-Identifier: MIT
"""Start values of the likelihood from several shifts of the linear method."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from drivetwin.estimation.likelihood.optimize.initial_guess import (
    TYPICAL_LAW,
    estimate_initial_values,
)
from drivetwin.vehicle.spec import PriorValue

IDS = ("eta", "J_out", "J_vehicle", "Tv_over_if", "k_o", "c_o", "te_delay")
VALUES = np.array([0.9, 1.0, 4000.0, 500.0, 1e5, 150.0, 0.02])


def _friction(mu_c: float, largest: float) -> Any:
    theta = np.array([mu_c, 0.02, 1e-4, np.log(12.0), 8e4])
    curve = SimpleNamespace(slip=np.array([0.0, largest]))
    return SimpleNamespace(fit=SimpleNamespace(theta=theta), curve=curve, P0=8e4)


def _shift(friction: Any = None, load: Any = None, values: Any = VALUES) -> Any:
    momentum = SimpleNamespace(value=lambda name: {"J_e": 4.0, "te_delay": 0.02}[name])
    load = load or SimpleNamespace(load=500.0, holds_at=None)
    return SimpleNamespace(ids=IDS, values=values, momentum=momentum, load=load, friction=friction)


def _driveline(offgoing: str, oncoming: str) -> Any:
    couplings = {
        name: SimpleNamespace(name=name, P0=PriorValue(7e4), drum=PriorValue(0.0))
        for name in (offgoing, oncoming)
    }
    ends = {"offgoing": couplings[offgoing], "oncoming": couplings[oncoming]}
    return cast("Any", SimpleNamespace(i_f=5.0, i_after=1.0, couplings=couplings, **ends))


def test_an_element_starts_from_the_curve_that_reaches_the_largest_slip() -> None:
    """Whichever shift is last: one without a curve, or with one over a few rad/s, tells nothing."""
    shifts = [_shift(_friction(0.11, 80.0)), _shift(_friction(0.13, 10.0)), _shift()]
    drivelines = [_driveline("B3", "B4"), _driveline("B5", "B4"), _driveline("B3", "B4")]
    found = estimate_initial_values(shifts, drivelines)
    for element in ("B4", "B3", "B5"):
        assert found[f"{element}.mu_c"] == pytest.approx(0.11)
    alone = estimate_initial_values([_shift()], [_driveline("B1", "B2")])
    assert alone["B1.mu_c"] == alone["B2.mu_c"] == TYPICAL_LAW["mu_c"]


def test_one_shift_that_tells_something_wrong_does_not_start_all() -> None:
    wrong = VALUES * np.array([1.0, 1.0, -0.5, 1.0, 1.0, 1.0, 1.0])
    found = estimate_initial_values(
        [_shift(values=wrong), _shift(), _shift()], [_driveline("B1", "B2")] * 3
    )
    assert found["J_vehicle"] == 4000.0


def test_the_load_of_a_shift_is_taken_at_its_own_speed() -> None:
    """At 10 rad/s both shifts have 500 N m; one's growth by itself is ten times too large."""

    def load(growth: float) -> Any:
        theta = np.array([500.0 + growth * (20.0**2 - 10.0**2) / 5.0, 4000.0, growth])
        return SimpleNamespace(
            load=float(theta[0]), holds_at=20.0, mean_speed=10.0, fit=SimpleNamespace(theta=theta)
        )

    shifts = [_shift(load=load(growth)) for growth in (1.0, 1.0, 10.0)]
    for shift, growth in zip(shifts, (1.0, 1.0, 10.0), strict=True):
        shift.ids, shift.values = (*IDS, "aero"), np.append(VALUES, growth)
    found = estimate_initial_values(shifts, [_driveline("B1", "B2")] * 3)
    assert found["aero"] == 1.0
    assert found["Tv_over_if"] == pytest.approx(560.0)
    assert found["start2.load"] == pytest.approx(0.0, abs=1e-9)
