# SPDX-License-Identifier: MIT
"""Direct estimates of one shift against an independent simulator: exact without noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.segments import MOMENTUM, find_off_going_release
from drivetwin.estimation.data.shift_data import KnownDriveline, ShiftSignals
from drivetwin.estimation.direct.friction_law import estimate_friction_law, evaluate_stribeck
from drivetwin.estimation.direct.load_balance import estimate_load
from drivetwin.estimation.direct.momentum_balance import MomentumFit, estimate_momentum_inertia
from drivetwin.likelihood.measured_signal import MeasuredSignal
from tests.estimation.synthetic import Run, Truth

SLIPS = np.array([15.0, 30.0, 40.0, 50.0])


def estimate_inertia(signals: ShiftSignals, driveline: KnownDriveline) -> MomentumFit:
    return estimate_momentum_inertia(signals, driveline, MOMENTUM, 12.0)


def test_inertia_load_and_friction_return_without_noise(stepped: Run) -> None:
    signals, truth = stepped.signals(), Truth()
    driveline = truth.driveline()
    found = estimate_inertia(signals, driveline)
    assert found.get_value("eta") == pytest.approx(truth.eta, rel=5e-4)
    assert found.get_value("J_e") == pytest.approx(truth.J_e, rel=5e-4)
    load, J_vehicle = estimate_load(signals, truth.i_f)
    assert (load, J_vehicle) == pytest.approx((truth.load, truth.J_vehicle), rel=5e-4)
    mu, _ = evaluate_stribeck(estimate_friction_law(signals, driveline), SLIPS)
    assert mu == pytest.approx([truth.mu(slip) for slip in SLIPS], rel=0.02)


@pytest.mark.parametrize("age", [0.0, 0.004, 0.02])
def test_age_of_the_engine_torque_is_found(stepped: Run, age: float) -> None:
    fresh = stepped.time[::10]
    values = np.array([stepped.manoeuvre.engine_torque(t - age) for t in fresh])
    late = replace(stepped.signals(), engine_torque=MeasuredSignal(fresh, values, 5.0))
    found = estimate_inertia(late, Truth().driveline())
    assert found.get_value("te_delay") == pytest.approx(age, abs=1e-4)
    assert found.get_value("eta") == pytest.approx(0.85, rel=5e-4)


def test_a_lingering_off_going_element_leaves_no_friction_points(constant: Run) -> None:
    signals, driveline = constant.signals(), Truth().driveline(P0_std=5e3)
    low = signals.pressures["B2"]
    held = replace(low, values=np.maximum(low.values, Truth().P0 + 3e3))
    lingering = replace(signals, pressures={**signals.pressures, "B2": held})
    free = find_off_going_release(lingering, driveline, MOMENTUM)
    assert free == pytest.approx(signals.shift.lockup_time, abs=2e-3)
    with pytest.raises(IdentificationError):
        estimate_friction_law(lingering, driveline)


def test_torque_that_flows_back_throughout_has_no_equation_by_the_dissipative_law(
    constant: Run,
) -> None:
    signals = constant.signals()
    torque = signals.output_torque
    dragged = replace(signals, output_torque=replace(torque, values=-np.abs(torque.values)))
    driveline = replace(Truth().driveline(), loss_law="dissipative")
    with pytest.raises(IdentificationError, match="nowhere does torque flow from the engine"):
        estimate_inertia(dragged, driveline)
