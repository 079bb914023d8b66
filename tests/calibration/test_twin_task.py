# SPDX-License-Identifier: MIT
"""From a twin and a request to a task: defaults, draws of the covariance, refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.calibration.calibrate import draw_for
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.options import USUAL_WHEEL_RADIUS
from drivetwin.calibration.policies.kind import PolicyKind
from drivetwin.calibration.policies.slip import SlipPolicy
from drivetwin.calibration.scenarios import Purpose
from drivetwin.calibration.spread import Spread
from drivetwin.calibration.twin_task import Request, build_task
from drivetwin.errors import IdentificationError, InputError
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.simulation.added_elements import NO_ADDED_ELEMENTS
from drivetwin.simulation.shift_control import ControlledUnit
from tests.calibration.cases import ACTUATOR, FILLING, QUICK
from tests.calibration.twins import ADDED_ELEMENTS, STD, extend_twin, make_hydraulic_twin, make_twin

REQUEST = Request(gears=("2", "3"), settings=QUICK)
_DRAWN = {"eta": "i_in.loss.eta", "k_o": "output shaft.stiffness", "J_vehicle": "J_v.inertia"}
"""Paths of some numbers by the parameter that they are."""


def test_operating_point_and_limits_come_from_the_twin() -> None:
    task = build_task(make_twin(), REQUEST)
    assert task.maneuver.point.engine_torque == 1200.0
    assert task.maneuver.point.engine_speed == 155.0
    assert [one.metric for one in task.limits] == [
        Metric.SHIFT_TIME,
        Metric.VIBRATION_DOSE,
        Metric.FRICTION_ENERGY,
    ]


def test_the_wheel_radius_is_that_of_the_request_then_that_of_the_twin() -> None:
    car = replace(make_twin(), wheel_radius=0.31)
    for twin, request, radius in (
        (car, REQUEST, 0.31),
        (car, replace(REQUEST, wheel_radius=0.3), 0.3),
        (make_twin(), REQUEST, USUAL_WHEEL_RADIUS),
    ):
        assert build_task(twin, replace(request, limits=())).maneuver.wheel_radius == radius


def test_draws_have_the_covariance_of_the_twin() -> None:
    twin = make_twin()
    task = build_task(twin, replace(REQUEST, spread=Spread(0.0, 0.0, 0.0), limits=()))
    sets = draw_for(task, 1500, Purpose.SEARCH).sets
    for parameter, name in _DRAWN.items():
        value = twin.parameters[parameter].value
        assert value is not None
        assert sets[name].std() / value == pytest.approx(STD, rel=0.08)
    band = 0.02 / 1.959963984540054  # half width of the friction band in standard deviations
    assert (sets["B3.friction.mu_c"] / 0.12).std() == pytest.approx(band, rel=0.08)
    assert (sets["B3.friction.mu_c"] != sets["B2.friction.mu_c"]).all()


def test_draws_follow_correlations() -> None:
    twin = make_twin()
    assert twin.covariance is not None
    ids = twin.covariance_ids
    a, b = ids.index("k_o"), ids.index("J_vehicle")
    covariance = twin.covariance.copy()
    covariance[a, b] = covariance[b, a] = 0.9 * np.sqrt(covariance[a, a] * covariance[b, b])
    task = build_task(replace(twin, covariance=covariance), replace(REQUEST, limits=()))
    sets = draw_for(task, 800, Purpose.SEARCH).sets
    found = np.corrcoef(sets[_DRAWN["k_o"]], sets[_DRAWN["J_vehicle"]])
    assert found[0, 1] == pytest.approx(0.9, abs=0.03)


@pytest.mark.parametrize("part", list(ADDED_ELEMENTS))
def test_draws_contain_the_part(part: str) -> None:
    plain = replace(REQUEST, spread=Spread(0.0, 0.0, 0.0), limits=())
    task = build_task(extend_twin(make_twin(), ADDED_ELEMENTS[part]), plain)
    assert task.maneuver.added != NO_ADDED_ELEMENTS
    sets = draw_for(task, 600, Purpose.SEARCH).sets
    relative = {
        "input shaft": ("input shaft.stiffness", np.hypot(2.0 * STD, np.hypot(STD, 2**0.5 * STD))),
        "backlash": ("output shaft.gap", STD),
        "tyre": ("tyre.slip_stiffness", 2**0.5 * STD),
        "progressive shaft": ("output shaft.torque.0", None),
    }
    path, std = relative[part]
    if std is None:
        assert np.unique(sets[path]).size == 600
    else:
        assert sets[path].std() / sets[path].mean() == pytest.approx(std, rel=0.08)


def test_a_part_without_an_interval_is_held() -> None:
    twin = extend_twin(make_twin(), ADDED_ELEMENTS["backlash"])
    ids, covariance = make_twin().covariance_ids, make_twin().covariance
    known = replace(twin, covariance_ids=ids, covariance=covariance)
    task = build_task(known, replace(REQUEST, limits=()))
    assert task.maneuver.added.gap == 0.02
    assert "output shaft.gap" not in draw_for(task, 20, Purpose.SEARCH).sets


def test_a_twin_without_identified_values_is_refused() -> None:
    with pytest.raises(IdentificationError, match="not valid"):
        build_task(make_twin(Verdict.WEAK), REQUEST)


def test_what_the_twin_does_not_say_must_be_given() -> None:
    bare = replace(make_twin(), validity={})
    with pytest.raises(InputError, match="torque and speed"):
        build_task(bare, REQUEST)
    asked = replace(REQUEST, engine_torque=1000.0, engine_speed=150.0, limits=())
    with pytest.raises(InputError, match="pressures"):
        build_task(bare, asked)
    task = build_task(bare, replace(asked, system_pressure=12e5))
    assert task.maneuver.point.engine_torque == 1000.0


def test_a_slip_loop_has_the_actuators_of_the_twin() -> None:
    asked = replace(REQUEST, policy=PolicyKind.SLIP, task=0.02, engine_lag=0.03, limits=())
    task = build_task(make_hydraulic_twin(), asked)
    assert isinstance(task.policy, SlipPolicy)
    assert task.policy.base.task == 0.02
    assert task.policy.unit == ControlledUnit(ACTUATOR.model, FILLING.model, 0.03)
    units = draw_for(task, 5, Purpose.SEARCH).units
    assert len({one.oncoming.fill_time for one in units}) == 5
    with pytest.raises(InputError, match="no actuator of B2 and B3"):
        build_task(make_twin(), asked)


@pytest.mark.parametrize("kind", [one for one in PolicyKind if one is not PolicyKind.OWN])
def test_a_start_by_name(kind: PolicyKind) -> None:
    twin = make_hydraulic_twin()
    policy = build_task(twin, replace(REQUEST, policy=kind, limits=())).policy
    one = next(one for one in policy.parameters if one.free)
    start = {one.name: 0.9 * one.low + 0.1 * one.high}
    task = build_task(twin, replace(REQUEST, policy=kind, start=start, limits=()))
    assert {one.name: one.start for one in task.policy.parameters}.items() >= start.items()
    with pytest.raises(InputError, match="no parameter wrong"):
        build_task(twin, replace(REQUEST, policy=kind, start={"wrong": 0.1}, limits=()))


def test_the_own_policy_needs_a_controller() -> None:
    with pytest.raises(InputError, match="needs a controller"):
        build_task(make_hydraulic_twin(), replace(REQUEST, policy=PolicyKind.OWN, limits=()))


def test_a_downshift_with_power_has_its_own_parameters() -> None:
    task = build_task(make_twin(), replace(REQUEST, gears=("3", "2"), limits=()))
    assert task.maneuver.inertia_first
    assert "assist_pressure" in [one.name for one in task.policy.parameters]
