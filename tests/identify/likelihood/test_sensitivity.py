# SPDX-License-Identifier: MIT
"""Sensor sensitivity against the exact laws of scale: torque-like quantities share one scale."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from drivetwin.identify.likelihood.curves import curves_of
from drivetwin.identify.likelihood.tolerance import Sensitivity, sensitivity
from tests.identify.likelihood.made import bench, fitted


@cache
def found() -> Sensitivity:
    fit = fitted()
    friction = curves_of(fit, {}, np.zeros_like(fit.covariance))
    return sensitivity(fit, [bench().signals], friction)


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


def test_every_sensor_has_a_gain_an_offset_and_an_age() -> None:
    roles = {error.rsplit(" ", 1)[0] for error in found().errors}
    assert {"engine_torque", "output_torque", "input_speed", "pressure.B3"} <= roles
    assert len(found().errors) == 3 * len(roles)
    assert found().change.shape == (len(found().ids), len(found().errors))
    assert np.isfinite(found().change).all()


def test_an_offset_is_a_share_of_the_largest_reading() -> None:
    torque = bench().signals.engine_torque.values
    size = found().sizes[found().errors.index("engine_torque offset")]
    assert size == pytest.approx(0.01 * np.abs(torque).max(), rel=0.02)
