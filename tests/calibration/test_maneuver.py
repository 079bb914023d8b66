# SPDX-License-Identifier: MIT
"""The shift to be calibrated: steady start, direction, kinds that have no policy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.calibration.maneuver import Maneuver, OperatingPoint, check_torque_phase_first
from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import Signal, simulate
from tests.calibration.cases import SYSTEM, make_downshift, make_upshift


@pytest.mark.parametrize("shift", [make_upshift(), make_downshift()])
def test_start_accelerates_steadily(shift: Maneuver) -> None:
    time = shift.time[:300]
    constant = {
        shift.offgoing.name: Signal(time[[0, -1]], np.full(2, SYSTEM)),
        shift.oncoming.name: Signal(time[[0, -1]], np.zeros(2)),
    }
    torque = Signal(time[[0, -1]], np.full(2, shift.point.engine_torque))
    run = simulate(shift.model, torque, constant, shift.build_start(), time)
    assert np.ptp(run.shaft_torque) < 1e-6 * np.abs(run.shaft_torque).max()
    slope = np.diff(run.output_speed) / shift.step
    expected = shift.compute_acceleration(shift.point.engine_torque, shift.ratios[0])
    assert slope == pytest.approx(expected, rel=1e-6)


def test_direction_is_that_of_the_engine_speed() -> None:
    assert make_upshift().direction == -1.0
    assert make_downshift().direction == 1.0


@pytest.mark.parametrize(
    ("shift", "torque"),
    [(make_upshift(), -100.0), (make_upshift(), 0.0), (make_downshift(), 300.0)],
)
def test_other_kinds_are_refused(shift: Maneuver, torque: float) -> None:
    check_torque_phase_first(shift)
    other = replace(shift, point=OperatingPoint(torque, shift.point.engine_speed))
    with pytest.raises(InputError, match="cannot be calibrated"):
        check_torque_phase_first(other)
