# SPDX-License-Identifier: MIT
"""The paper's procedure: right on noise-free data on its grid, doubtful where it must be."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.errors import IdentificationError
from drivetwin.estimation.direct.load_balance import compute_window_edges
from drivetwin.estimation.paper.pipeline import (
    ETA_GRID,
    Weighting,
    fit_weighted_inertia,
    identify_paper_shift,
)
from drivetwin.findings import Code
from tests.estimation.synthetic import Run, Truth

RANGES = ((5.0, 40.0), (5000.0, 9000.0))


def test_noise_free_log_returns_the_truth_on_the_grid(stepped: Run) -> None:
    found = identify_paper_shift(stepped.signals(), Truth().driveline(), *RANGES)
    J_prime = Truth().J_e + Truth().J_out / Truth().i_a ** 2
    assert found.values["eta"] == 0.85
    assert found.values["Tv_over_if"] == 2300.0
    assert found.values["J_prime_2"] == pytest.approx(J_prime, rel=0.01)
    assert found.values["J_vehicle"] == pytest.approx(Truth().J_vehicle, rel=0.003)
    assert found.values["f_d_3"] == pytest.approx(12.0, rel=0.005)
    assert found.values["zeta_3"] == pytest.approx(0.06, rel=0.05)
    assert found.doubts == {}


def test_tables_have_the_papers_rows(stepped: Run) -> None:
    found = identify_paper_shift(stepped.signals(), Truth().driveline(), *RANGES)
    assert tuple(row.value for row in found.inertia.rows) == ETA_GRID
    loads = [row.value for row in found.load.rows]
    assert loads[0] == 0.0
    assert loads[-1] == 4000.0
    assert {2100.0, 2200.0, 2300.0, 2400.0} <= set(loads)
    # The RMS error is a torque at the output shaft: its slope over eta is i_g times rms T_e.
    steep = (found.inertia.rows[0].rmse - found.inertia.rows[1].rmse) / 0.05
    torque = stepped.columns["engine_torque"][: int(1e3 * stepped.manoeuvre.fill)]
    assert 0.3 < steep / (1.91 * float(np.sqrt(np.mean(torque**2)))) <= 1.0


def test_extremes_of_a_vibrating_torque_show_the_friction_law(stepped: Run) -> None:
    found = identify_paper_shift(stepped.signals(), Truth().driveline(), *RANGES)
    assert found.friction is not None
    curve = found.friction.curve
    truth = np.array([Truth().mu(s) for s in curve.points_slip])
    assert np.max(np.abs(curve.points_mu / truth - 1.0)) < 0.02
    inner = curve.slip[3:-3]
    smooth = np.array([Truth().mu(s) for s in inner])
    assert np.max(np.abs(curve.mu[3:-3] / smooth - 1.0)) < 0.02


def test_constant_engine_torque_raises_doubt(constant: Run) -> None:
    found = identify_paper_shift(
        constant.noisy(np.random.default_rng(0)), Truth().driveline(), *RANGES
    )
    assert Code.PAPER_POORLY_EXCITED in [one.code for one in found.doubts["eta"]]
    assert "J_prime_2" in found.doubts


def test_samples_outside_the_plausible_range_weigh_a_hundredth() -> None:
    torque, acceleration = np.array([20.0, 100.0]), np.array([1.0, 1.0])
    slope, weights = fit_weighted_inertia(torque, acceleration, Weighting(5.0, 40.0))
    assert weights.tolist() == [1.0, 0.01]
    assert slope == pytest.approx((20.0 + 1.0) / 1.01)


def test_constant_speed_and_short_gear_are_refused() -> None:
    with pytest.raises(IdentificationError, match="speed is constant"):
        fit_weighted_inertia(np.ones(5), np.zeros(5), Weighting(5.0, 40.0))
    with pytest.raises(IdentificationError, match=r"0\.030 s of held gear"):
        compute_window_edges((1.0, 1.03))
