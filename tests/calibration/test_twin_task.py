# SPDX-License-Identifier: MIT
"""From a twin and a request to a task: defaults, draws of the covariance, refusals."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin.calibration.identified_range import check_identified_range
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.objective import Hardware, Limit
from drivetwin.calibration.options import PolicyKind
from drivetwin.calibration.scenarios import UnitDraws
from drivetwin.calibration.spread import OilFriction, Spread
from drivetwin.calibration.twin_task import Request, build_task
from drivetwin.errors import IdentificationError, InputError
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.findings import Code
from drivetwin.simulation.driveline_run import simulate
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import simulate as simulate_network
from drivetwin.simulation.shift_control import ControlledUnit
from tests.calibration.cases import (
    QUICK,
    SYSTEM,
    draw,
    make_plant,
    make_task,
    start,
    start_profiles,
)
from tests.calibration.twins import (
    ACTUATOR,
    ADDED_ELEMENTS,
    FILLING,
    STD,
    extend_twin,
    make_exact_twin,
    make_hydraulic_twin,
    make_twin,
)
from tests.support.upshift.statement import BAR

REQUEST = Request(gears=("2", "3"), settings=QUICK)
_DRAWN = {"eta": "i_in.loss.eta", "k_o": "output shaft.stiffness", "J_vehicle": "J_v.inertia"}
"""Paths of some numbers by the parameter that they are."""


def test_operating_point_and_limits_come_from_the_twin() -> None:
    task = build_task(make_twin(), REQUEST)
    assert task.maneuver.point.engine_torque == 1200.0
    assert task.maneuver.point.engine_speed == 155.0
    hardware = {
        Metric.TORQUE_REDUCTION: 480.0,
        Metric.TORQUE_RATE: 5e3,
        Metric.PRESSURE_RATE: 150e5,
    }
    assert [one.metric for one in task.limits] == [
        Metric.SHIFT_TIME,
        Metric.VIBRATION_DOSE,
        Metric.FRICTION_ENERGY,
        *hardware,
    ]
    assert {one.metric: one.bound for one in task.limits[3:]} == hardware
    assert all("usual" in one.source for one in task.limits[3:])


def test_the_operating_point_is_that_of_the_shift_in_the_log() -> None:
    base = make_twin()
    shift = {"torque 2-3": (1000.0, 1100.0), "speed 2-3": (170.0, 170.0), "speed 3-2": (1.0, 1.0)}
    task = build_task(replace(base, validity={**base.validity, **shift}), REQUEST)
    point = task.maneuver.point
    assert (point.engine_torque, point.engine_speed) == (1050.0, 170.0)


def test_hardware_can_be_changed() -> None:
    usual = build_task(make_twin(), REQUEST)
    wide = Hardware(intervention=0.5, torque_rate=float("inf"), kiss=1.5)
    stated = (Limit(Metric.PRESSURE_RATE, 1e7), Limit(Metric.SHIFT_TIME, 1.4))
    other = build_task(make_twin(), replace(REQUEST, hardware=wide, limits=stated))
    assert {one.metric: one.bound for one in other.limits} == {
        Metric.PRESSURE_RATE: 1e7,
        Metric.SHIFT_TIME: 1.4,
        Metric.TORQUE_REDUCTION: 600.0,
    }
    for task, factor in ((usual, 1.3), (other, 1.5)):
        bound = next(one for one in task.policy.parameters if one.name == "kiss_pressure").high
        assert bound == pytest.approx(factor * 0.8 * BAR)


def test_draws_have_the_covariance_of_the_twin() -> None:
    twin = make_twin()
    task = build_task(twin, replace(REQUEST, spread=Spread(0.0, 0.0, 0.0), limits=()))
    sets = draw(task, 1500).sets
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
    sets = draw(task, 800).sets
    found = np.corrcoef(sets[_DRAWN["k_o"]], sets[_DRAWN["J_vehicle"]])
    assert found[0, 1] == pytest.approx(0.9, abs=0.03)


@pytest.mark.parametrize("part", list(ADDED_ELEMENTS))
def test_draws_contain_the_part(part: str) -> None:
    plain = replace(REQUEST, spread=Spread(0.0, 0.0, 0.0), limits=())
    task = build_task(extend_twin(make_twin(), ADDED_ELEMENTS[part]), plain)
    sets = draw(task, 600).sets
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
    control: Any = start(task)
    assert control.controller.task == 0.02
    assert control.unit == ControlledUnit(ACTUATOR.model, FILLING.model, 0.03)
    units = draw(task, 5).units
    assert len({one.oncoming.fill_time for one in units}) == 5
    with pytest.raises(InputError, match="no actuator of B2 and B3"):
        build_task(make_twin(), asked)


def test_a_downshift_with_power_has_its_own_parameters() -> None:
    task = build_task(make_twin(), replace(REQUEST, gears=("3", "2"), limits=()))
    assert task.maneuver.inertia_first
    assert "assist_pressure" in [one.name for one in task.policy.parameters]


def make_exact_task(**spread: float) -> Any:
    """Return a task of exact values, with a spread between units."""
    none = Spread(gain=0.0, engine_torque=0.0, contact_pressure=0.0, oil_temperature=0.0)
    return make_task(twin=make_exact_twin(), spread=replace(none, **spread))


def test_units_have_the_stated_spread() -> None:
    sets = draw(make_task(twin=make_exact_twin()), 3000).sets
    for name, std in (("B3.gain", 0.025), ("i_in.loss.eta", 0.015)):
        assert sets[name].std() / sets[name].mean() == pytest.approx(std, rel=0.06)
    contact = [sets[f"{name}.p0"] - sets[f"{name}.p0"].mean() for name in ("B2", "B3")]
    assert contact[0].std() == pytest.approx(5e3, rel=0.06)
    assert contact[0] == pytest.approx(contact[1])


def test_a_torque_scale_is_a_scale_of_the_torque() -> None:
    task = make_exact_task(engine_torque=0.05)
    shift, profiles, drawn = task.maneuver, start_profiles(task), draw(task, 1)
    scale = float(drawn.sets["i_in.loss.eta"][0]) / shift.model.eta
    louder = replace(shift, point=replace(shift.point, engine_torque=1400.0 * scale))
    torque = Signal(profiles.engine_torque.time, scale * profiles.engine_torque.values)
    pressures = {"B2": profiles.offgoing, "B3": profiles.oncoming}
    exact = simulate(shift.model, torque, pressures, louder.build_start(), shift.time)
    found = make_plant(shift).simulate(profiles, drawn, (shift.body.drive,)).columns[0, 0]
    assert found == pytest.approx(exact.shaft_torque, abs=1e-5 * np.abs(exact.shaft_torque).max())


def test_drawn_actuators_have_the_stated_spread_and_covariance() -> None:
    covariance = np.zeros((7, 7))
    covariance[4, 4], covariance[6, 6] = 400.0, np.inf
    one = replace(FILLING, covariance=covariance)
    twin = replace(make_hydraulic_twin(), actuators={"B2": one, "B3": one})
    task = make_task(twin=twin, policy=PolicyKind.SLIP, spread=Spread(kiss_pressure=0.0))
    units = draw(task, 3000).units
    dead = np.array([each.oncoming.dead_time for each in units])
    kiss = np.array([each.oncoming.kiss_pressure for each in units])
    assert dead.std() == pytest.approx(5e-3, rel=0.06)
    assert np.log([each.engine_lag for each in units]).std() == pytest.approx(0.15, rel=0.06)
    assert kiss.std() == pytest.approx(20.0, rel=0.06)
    assert {each.oncoming.hysteresis for each in units} == {one.model.hysteresis}
    assert all(each.offgoing.dead_time == each.oncoming.dead_time for each in units)


def test_draws_of_an_actuator_keep_correlations_of_small_values_beside_pressures() -> None:
    std = np.array([4e-4, 0.02, 4e-4, 0.01, 5e4, 0.1, 4e3])
    correlation, some = np.full((7, 7), 1e-3) + (1.0 - 1e-3) * np.eye(7), [0, 2, 3, 6]
    correlation[np.ix_(some, some)] = [
        [1.0, -0.96, 0.86, -0.68],
        [-0.96, 1.0, -0.93, 0.67],
        [0.86, -0.93, 1.0, -0.86],
        [-0.68, 0.67, -0.86, 1.0],
    ]
    one = replace(FILLING, covariance=np.outer(std, std) * correlation)
    draws = UnitDraws(one, one, 0.05, Spread(dead_time=0.0, actuator_lag=0.0))
    random = np.random.default_rng(1)
    units = [draws(random)(random).offgoing for _ in range(2000)]
    drawn = np.array([[unit.dead_time, unit.falling_lag] for unit in units])
    assert drawn.std(axis=0) == pytest.approx(std[[0, 2]], rel=0.1)
    assert np.corrcoef(drawn.T)[0, 1] == pytest.approx(-0.96, abs=0.02)


def test_draws_follow_seed_and_purpose_and_keep_their_units() -> None:
    task = make_task(policy=PolicyKind.SLIP)
    first, again, other = (draw(task, 6, one) for one in ("POLISH", "POLISH", "CERTIFICATE"))
    odd = np.arange(6) % 2 == 1
    both, order = first.select(odd).join(first.select(~odd)), [1, 3, 5, 0, 2, 4]
    assert [first.units[k] for k in order] == list(both.units)
    for name, values in first.sets.items():
        assert (values == again.sets[name]).all()
        assert (values != other.sets[name]).any()
        assert np.array_equal(both.sets[name], values[order])


def test_oil_changes_the_friction_of_a_type_and_its_temperature_that_of_a_unit() -> None:
    exact = make_exact_task()
    known = OilFriction(-2e-3, 6e-4, log_temperature=340.0)
    given: dict[str, Any] = {"twin": make_exact_twin(), "oil_temperature": 380.0, "oil": known}
    hot: Any = make_task(**given, spread=exact.draw.driveline.spread)
    cold, warm = (one.maneuver.model.elements[1].friction.mu_c for one in (exact, hot))
    assert warm == pytest.approx(0.92 * cold)
    levels = draw(hot, 600).sets["B3.friction.mu_c"]
    assert levels.std() / levels.mean() == pytest.approx(40.0 * 6e-4 / 0.92, rel=0.1)
    spread = replace(exact.draw.driveline.spread, oil_temperature=5.0)
    made = make_task(twin=make_exact_twin(), spread=spread, oil=OilFriction(-2e-3, 0.0))
    levels = draw(made, 600).sets["B3.friction.mu_c"]
    assert levels.std() / levels.mean() == pytest.approx(5.0 * 2e-3, rel=0.1)
    with pytest.raises(InputError, match="which oil temperature"):
        make_task(oil_temperature=380.0)
    logged = replace(make_twin(), validity={"oil_temperature": (330.0, 350.0)})
    of_log: Any = make_task(twin=logged, oil_temperature=380.0, oil=OilFriction(-2e-3, 0.0))
    assert of_log.maneuver.model.elements[1].friction.mu_c == pytest.approx(0.92 * cold)
    assert of_log.maneuver.point.oil_temperature == 380.0


@pytest.mark.parametrize("part", ["none", *ADDED_ELEMENTS])
def test_start_accelerates_steadily(part: str) -> None:
    twin = extend_twin(make_twin(), ADDED_ELEMENTS.get(part, {}))
    shift = build_task(twin, replace(REQUEST, limits=())).maneuver
    held = {"B2": SYSTEM, "B3": 0.0, "engine torque": shift.point.engine_torque}
    time = shift.time[:300]
    outputs: list[Any] = [("shaft_torque", "output shaft"), ("acceleration", "engine")]
    inputs = {name: Signal(time[[0, -1]], np.full(2, one)) for name, one in held.items()}
    run = simulate_network(shift.elements, inputs, shift.start, time, outputs)
    torque, rate = (run.columns[one] for one in outputs)
    assert np.ptp(torque) < 1e-4 * np.abs(torque).max()
    ratio = shift.ratios[0]
    expected = ratio * shift.compute_acceleration(shift.point.engine_torque, ratio)
    # A slipping tyre turns faster than the vehicle, and accelerates by as much more.
    assert rate == pytest.approx(expected, rel=0.01 if part == "tyre" else 1e-6)


def test_equal_gears_are_refused() -> None:
    twin = make_twin()
    elements = dict.fromkeys(twin.elements, twin.elements["B2"])
    gears = {name: replace(one, ratio=twin.gears["2"].ratio) for name, one in twin.gears.items()}
    with pytest.raises(InputError, match="same overall ratio"):
        make_task(twin=replace(twin, elements=elements, gears=gears))


def test_a_finding_names_what_leaves_the_identified_range_and_when() -> None:
    base = make_twin()
    twin = replace(base, validity={**base.validity, "speed": (60.0, 200.0)})
    task = build_task(twin, replace(REQUEST, limits=()))
    profiles = start_profiles(task)
    assert check_identified_range(twin, task.maneuver, profiles) == ()
    narrow = replace(twin, validity={**twin.validity, "torque": (1150.0, 1500.0)})
    (found,) = check_identified_range(narrow, task.maneuver, profiles)
    assert found.code is Code.OUTSIDE_IDENTIFIED_RANGE
    assert found.subject == "torque"
    torque = profiles.engine_torque
    assert found.place.time == torque.time[np.argmin(torque.values)] - task.maneuver.request
