# SPDX-License-Identifier: MIT
"""Delays of the sensors against what must hold of them, and against a fit of older signals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.estimation.likelihood.effects.correction import keep_fit
from drivetwin.estimation.likelihood.optimize.multistart import fit_multistart
from drivetwin.estimation.likelihood.uncertainty.friction_bands import build_friction_curves
from drivetwin.estimation.likelihood.uncertainty.sensor_tolerance import (
    Sensitivity,
    compute_sensitivity,
    compute_sensor_shifts,
)
from drivetwin.estimation.linear.estimates import apply_sensor_error
from drivetwin.vehicle.spec import SensorTolerance
from tests.estimation.likelihood.fixtures import bench, fitted, problem
from tests.support.arrays import FloatArray
from tests.support.shared_results import shared

DELAY = 1e-3
OTHERS = (
    "output_torque",
    "engine_speed",
    "output_speed",
    "wheel_speed",
    "pressure.B2",
    "pressure.B3",
)


def shifts(*roles: str) -> FloatArray:
    """Sum of the shifts of all unknowns by values of `roles` that are `DELAY` older."""
    found = compute_sensor_shifts(fitted(), {role: SensorTolerance(delay=DELAY) for role in roles})
    assert set(found) <= {f"{role} delay" for role in roles}
    return np.asarray(sum(found.values()))


def in_deviations(shift: FloatArray) -> dict[str, float]:
    std = np.sqrt(np.diag(fitted().covariance))
    return dict(zip(fitted().point.names, shift / std, strict=True))


def test_an_older_engine_torque_has_a_larger_age_and_changes_nothing_else() -> None:
    shift = shifts("engine_torque")
    names = fitted().point.names
    assert shift[names.index("te_delay")] == pytest.approx(DELAY, rel=0.02)
    others = {name: one for name, one in in_deviations(shift).items() if name != "te_delay"}
    assert max(map(abs, others.values())) < 0.3


def test_where_all_else_is_older_the_engine_torque_is_younger() -> None:
    """A time base that is moved moves no other parameter."""
    shift = shifts(*OTHERS)
    names = fitted().point.names
    assert shift[names.index("te_delay")] == pytest.approx(-DELAY, rel=0.05)
    whole = {n: one for n, one in in_deviations(shift).items() if n in ("k_o", "c_o", "eta", "J_e")}
    assert max(map(abs, whole.values())) < 0.5


def test_the_shift_is_that_of_a_fit_of_older_values() -> None:
    made = bench()
    older = apply_sensor_error(made.signals, "output_torque", SensorTolerance(delay=DELAY))
    posed, _ = problem(replace(made, signals=older))
    again = fit_multistart(posed, fitted().point, [older.shift])
    moved = in_deviations(again.point.values - fitted().point.values)
    told = in_deviations(shifts("output_torque"))
    assert abs(told["te_delay"]) > 10.0
    assert told["te_delay"] == pytest.approx(moved["te_delay"], rel=0.02)
    assert abs(told["B3.mu_c"]) > 0.5
    assert max(abs(told[name] - moved[name]) for name in told) < 0.5


@shared
def found() -> Sensitivity:
    fit = fitted()
    friction = build_friction_curves(fit, {}, keep_fit(fit))
    return compute_sensitivity(fit, [bench().signals], friction)


def percent(name: str, error: str) -> float:
    """Change of one result in per cent of its value."""
    row, column = found().ids.index(name), found().errors.index(error)
    return float(100.0 * found().change[row, column] / found().values[row])


@pytest.mark.parametrize("name", ["J_vehicle", "Tv_over_if", "k_o", "c_o", "mu.B3", "eta"])
def test_a_gain_error_of_the_output_torque_scales_all_torques(name: str) -> None:
    assert percent(name, "output_torque gain") == pytest.approx(1.0, abs=0.05)


def test_a_gain_error_of_the_engine_torque_is_taken_for_efficiency() -> None:
    assert percent("eta", "engine_torque gain") == pytest.approx(-1.0, abs=0.05)
    assert percent("J_vehicle", "engine_torque gain") == pytest.approx(0.0, abs=0.1)


def test_frequency_and_damping_ratio_do_not_hang_on_the_scale_of_torque() -> None:
    for name in ("f_d_3", "zeta_3"):
        assert percent(name, "output_torque gain") == pytest.approx(0.0, abs=0.02)
