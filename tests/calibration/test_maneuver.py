# SPDX-License-Identifier: MIT
"""The shift to be calibrated: steady start, direction, kinds that have no policy."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.calibration.maneuver import Maneuver, OperatingPoint, check_gears
from drivetwin.calibration.twin_task import Request, build_task
from drivetwin.errors import InputError
from drivetwin.simulation.driveline import ENGINE, SHAFT
from drivetwin.simulation.driveline_run import simulate
from drivetwin.simulation.dual_clutch import ENGINE_TORQUE, Signal
from drivetwin.simulation.network import Output
from drivetwin.simulation.network import simulate as simulate_network
from tests.calibration.cases import SYSTEM, make_downshift, make_upshift
from tests.calibration.twins import ADDED_ELEMENTS, extend_twin, make_twin


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


@pytest.mark.parametrize("part", list(ADDED_ELEMENTS))
def test_start_with_a_part_accelerates_steadily(part: str) -> None:
    twin = extend_twin(make_twin(), ADDED_ELEMENTS[part])
    shift = build_task(twin, Request(gears=("2", "3"), limits=())).maneuver
    held = {"B2": SYSTEM, "B3": 0.0, ENGINE_TORQUE: shift.point.engine_torque}
    time = shift.time[:300]
    outputs: list[Output] = [("shaft_torque", SHAFT), ("acceleration", ENGINE)]
    inputs = {name: Signal(time[[0, -1]], np.full(2, one)) for name, one in held.items()}
    run = simulate_network(shift.elements, inputs, shift.start, time, outputs)
    torque, rate = (run.columns[one] for one in outputs)
    assert np.ptp(torque) < 1e-4 * np.abs(torque).max()
    ratio = shift.ratios[0]
    expected = ratio * shift.compute_acceleration(shift.point.engine_torque, ratio)
    # A slipping tyre turns faster than the vehicle, and accelerates by as much more.
    assert rate == pytest.approx(expected, rel=0.01 if part == "tyre" else 1e-6)


def test_direction_is_that_of_the_engine_speed() -> None:
    assert make_upshift().direction == -1.0
    assert make_downshift().direction == 1.0


@pytest.mark.parametrize(
    ("shift", "torque", "first"),
    [
        (make_upshift(), -100.0, True),
        (make_upshift(), 0.0, False),
        (make_upshift(), 100.0, False),
        (make_downshift(), 300.0, True),
        (make_downshift(), -300.0, False),
    ],
)
def test_the_engine_moves_by_itself_where_its_torque_has_the_direction(
    shift: Maneuver, torque: float, first: bool
) -> None:
    point = OperatingPoint(torque, shift.point.engine_speed)
    assert replace(shift, point=point).inertia_first is first


def test_equal_gears_are_refused() -> None:
    shift = make_upshift()
    old, _ = shift.model.elements
    same = replace(shift.model, elements=(old, replace(old, name="other")))
    with pytest.raises(InputError, match="same overall ratio"):
        check_gears(replace(shift, model=same))
