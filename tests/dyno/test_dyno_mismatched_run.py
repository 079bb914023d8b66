# SPDX-License-Identifier: MIT
"""Each effect against the nominal run: none at size zero, its law and its sign otherwise."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.integrate import cumulative_trapezoid

from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.errors import InputError
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.simulation.dual_clutch import Trajectory
from drivetwin.vehicle.effects import EffectId
from tests.support.arrays import FloatArray

SCENARIO = load_scenario("paper_steps")
MODEL = SCENARIO.model
SIZES = {
    name: 2.0 * one.std if one.has_columns else one.std
    for name, one in EFFECTS.items()
    if not one.on_sensor
}
"""Effects on the motion, twice their usual size; no column grows with that of a mode."""
GRADUAL = [name for name in SIZES if name.value not in ("input_shaft_mode", "backlash")]
"""Effects whose size may go to zero."""


def move(effects: Mapping[Any, float], scenario: Any = SCENARIO) -> Trajectory:
    return run(scenario, 1, noise=0.0, effects=effects).trajectory


@pytest.fixture(scope="module")
def nominal() -> Trajectory:
    return move({})


def find_lockup(motion: Trajectory) -> float:
    return next(e.time for e in motion.events if (e.element, e.kind) == ("B3", "lock"))


def compute_mean(values: FloatArray, motion: Trajectory, start: float, end: float) -> float:
    return float(np.mean(values[(motion.time >= start) & (motion.time <= end)]))


def compute_slipping(motion: Trajectory, element: str) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Pressure over P0 [Pa], μ in use and slip [rad/s] while the element slips."""
    one = SCENARIO.get_element(element)
    pressure = SCENARIO.actuators[element].compute_pressure(motion.time) - one.P0
    chosen = (np.abs(motion.slip[element]) > 0.05) & (pressure > 1e4)
    mu = motion.clutch_torque[element][chosen] / (one.gain * pressure[chosen])
    return pressure[chosen], np.abs(mu), np.abs(motion.slip[element][chosen])


def integrate_load(load: FloatArray, motion: Trajectory) -> FloatArray:
    """Change of the wheel's speed (n,) [rad/s] by an additional load [N m] in 2nd gear."""
    J4, J5 = MODEL.compute_side_inertias(1.91)
    inertia = (J4 + J5) * MODEL.i_f**2
    return -cumulative_trapezoid(load, motion.time, initial=0) / inertia


@pytest.mark.parametrize("name", EffectId)
def test_size_zero_gives_the_nominal_log_and_the_truth_is_that_of_the_model(
    name: EffectId,
) -> None:
    nominal, bench = (run(SCENARIO, 3, effects=effects) for effects in ({}, {name: 0.0}))
    for channel, other in zip(bench.channels, nominal.channels, strict=True):
        assert np.allclose(channel.values, other.values, rtol=1e-9, atol=1e-9)
    size = SIZES.get(name, 0.01)
    changed = run(SCENARIO, 3, effects={name: size})
    same = dict(nominal.truth.parameters)
    if name is EffectId.INPUT_SHAFT_MODE:  # the oscillation is that of the driveline as it is
        same |= {key: changed.truth.parameters[key] for key in ("f_d_3", "zeta_3")}
    assert changed.truth.parameters == same
    assert changed.truth.friction == nominal.truth.friction
    assert changed.truth.as_dict()["effects"] == {name.value: size}


@pytest.mark.parametrize("name", GRADUAL)
def test_the_change_of_the_motion_is_of_first_order_in_the_size(name: EffectId) -> None:
    """At small sizes; those of a tyre are larger, since a stiff one takes many steps."""
    first = SIZES[name] * (0.25 if name is EffectId.TYRE_SLIP else 0.02)
    base, half, whole = (move({name: size}) for size in (0.0, 0.5 * first, first))
    changes = [np.abs(each.engine_speed - base.engine_speed).max() for each in (half, whole)]
    assert changes[1] / changes[0] == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize("name", SIZES)
def test_a_run_starts_without_ringing(name: EffectId) -> None:
    """At constant engine torque the output torque is quasi-steady until the shift begins."""
    scenario = load_scenario("paper")
    motion = move({name: SIZES[name]}, scenario)
    early = motion.shaft_torque[motion.time < 0.5]
    # Speeds that grow change the load of the effects by less than this within 0.5 s.
    slow = {EffectId.AERO_LOAD: 40.0, EffectId.SLOW_LOAD: 40.0}.get(name, 0.5)
    assert np.ptp(early) < slow


def test_efficiency_raises_the_torque_of_the_new_gear(nominal: Trajectory) -> None:
    motion = move({"efficiency_by_gear": 0.01})
    before, after = (
        compute_mean(motion.shaft_torque - nominal.shaft_torque, motion, *span)
        for span in ((0.0, 2.0), (3.9, 4.9))
    )
    assert before == pytest.approx(0.0, abs=1e-6)
    # Of the additional torque at the output, the gearbox side takes its share of the inertia.
    J4, J5 = MODEL.compute_side_inertias(1.43)
    extra = 0.01 * 1.43 * compute_mean(np.full(motion.time.size, 1545.0), motion, 3.9, 4.9)
    accelerating = extra * J5 / (J4 + J5)
    assert after == pytest.approx(accelerating, rel=0.15)


def test_drag_before_the_shaft_lowers_its_torque_and_drag_behind_raises_it(
    nominal: Trajectory,
) -> None:
    for name, sign in (("input_drag", -1.0), ("brake_drag", 1.0)):
        motion = move({name: 0.02})
        change = compute_mean(motion.shaft_torque - nominal.shaft_torque, motion, 0.0, 2.0)
        assert sign * change > 10.0
        assert motion.wheel_speed[-1] < nominal.wheel_speed[-1] - 0.02


def test_a_load_that_grows_with_speed_is_small_at_first(nominal: Trajectory) -> None:
    motion = move({"aero_load": 0.2})
    early = motion.time < 2.0
    change = (motion.wheel_speed - nominal.wheel_speed)[early]
    mean = np.trapezoid(nominal.wheel_speed, nominal.time) / SCENARIO.duration
    load = 0.2 * MODEL.load.constant * ((motion.wheel_speed / mean) ** 2 - 1.0)
    expected = integrate_load(load, motion)[early]
    assert expected[-1] > 1e-3
    assert np.allclose(change, expected, atol=0.05 * np.max(np.abs(change)))


def test_drums_and_late_pressure_delay_the_lockup(nominal: Trajectory) -> None:
    locked = find_lockup(nominal)
    assert find_lockup(move({"drum_inertia": 0.05})) > locked + 1e-3
    late = find_lockup(move({"pressure_delay": 0.005})) - locked
    assert late == pytest.approx(0.005, rel=0.1)


def test_a_lag_moves_the_response_to_the_throttle(nominal: Trajectory) -> None:
    motion = move({"torque_lag": 0.015})
    early = motion.time < 1.9
    ages = np.linspace(0.0, 0.03, 31)
    errors = [
        np.std(
            motion.engine_speed[early]
            - np.interp(motion.time[early] - age, nominal.time, nominal.engine_speed)
        )
        for age in ages
    ]
    assert ages[int(np.argmin(errors))] == pytest.approx(0.015, abs=0.004)


def test_a_stiff_input_shaft_changes_less_than_a_soft_one(nominal: Trajectory) -> None:
    changes = [
        np.max(np.abs(move({"input_shaft_mode": frequency}).shaft_torque - nominal.shaft_torque))
        for frequency in (35.0, 70.0, 140.0)
    ]
    assert changes[0] > 1.5 * changes[1] > 2.0 * changes[2] > 0.0


def test_a_slipping_tyre_lets_the_wheel_follow_the_torque(nominal: Trajectory) -> None:
    motion = move({"tyre_slip": 0.004})
    early = motion.time < 2.0
    change = (motion.wheel_speed - nominal.wheel_speed)[early]
    torque = motion.shaft_torque[early]
    assert np.corrcoef(change, torque)[0, 1] > 0.5
    # Slip at FS, times the speed, bounds the change together with the damping of the oscillation.
    assert np.ptp(change) < 3.0 * 0.004 * float(np.max(motion.wheel_speed))


def test_backlash_is_passed_without_torque_where_the_torque_reverses() -> None:
    knots = ((0.0, 1545.0), (0.4, 1545.0), (0.5, -400.0), (0.9, -400.0), (1.0, 1545.0))
    pedal = replace(SCENARIO.engine_torque, knots=knots)
    scenario = replace(SCENARIO, engine_torque=pedal)
    free = [
        int(np.count_nonzero(move(effects, scenario).shaft_torque == 0.0))
        for effects in ({}, {"backlash": 0.03})
    ]
    assert free[0] == 0
    assert free[1] > 5


@pytest.mark.parametrize("factor", [0.03, 0.3])
def test_the_progressive_shaft_has_its_cubic(factor: float, nominal: Trajectory) -> None:
    motion = move({"progressive_shaft": factor})
    full = float(np.max(np.abs(nominal.shaft_torque)))
    rate = motion.output_speed - MODEL.i_f * motion.wheel_speed
    elastic = motion.shaft_torque - MODEL.c_o * rate
    linear = MODEL.k_o * motion.twist
    exact = linear * (1.0 + factor * ((linear / full) ** 2 - 0.5))
    assert np.max(np.abs(elastic - exact)) < 1e-3 * factor * full


def test_the_friction_wave_stands_beside_the_stribeck_law(nominal: Trajectory) -> None:
    _, mu, slip = compute_slipping(move({"friction_shape": 0.002}), "B3")
    wave = mu - SCENARIO.get_element("B3").friction.evaluate(slip)
    largest = float(np.max(np.abs(nominal.slip["B3"][nominal.clutch_torque["B3"] != 0.0])))
    exact = 0.002 * np.sin(4.0 * np.pi * slip / largest)
    assert np.max(np.abs(wave - exact)) < 3e-5
    assert np.ptp(wave) > 0.0035


def test_friction_rises_with_pressure_about_its_middle() -> None:
    pressure, mu, slip = compute_slipping(move({"friction_pressure": 0.03}), "B3")
    factor = mu / SCENARIO.get_element("B3").friction.evaluate(slip)
    rise = np.polyfit(pressure / np.max(pressure), factor - 1.0, 1)
    assert rise == pytest.approx([0.03, -0.015], abs=1e-3)


def compute_work(motion: Trajectory) -> FloatArray:
    """Friction work (n,) of B3 [J]."""
    power = np.abs(motion.slip["B3"] * motion.clutch_torque["B3"])
    return np.asarray(cumulative_trapezoid(power, motion.time, initial=0))


def test_friction_falls_with_the_friction_work(nominal: Trajectory) -> None:
    motion = move({"friction_heat": 0.03})
    whole = compute_work(nominal)[-1]
    one = SCENARIO.get_element("B3")
    pressure = SCENARIO.actuators["B3"].compute_pressure(motion.time) - one.P0
    chosen = (np.abs(motion.slip["B3"]) > 0.05) & (pressure > 1e4)
    share = compute_work(motion)[chosen] / whole
    capacity = one.gain * pressure[chosen] * one.friction.evaluate(motion.slip["B3"][chosen])
    factor = np.abs(motion.clutch_torque["B3"][chosen]) / capacity
    assert factor == pytest.approx(1.0 - 0.03 * share, abs=1e-5)
    assert find_lockup(motion) > find_lockup(nominal)


def test_walks_follow_the_seed_and_leave_the_noise() -> None:
    def record(seed: int, size: float) -> DynoRun:
        return run(SCENARIO, seed, effects={"slow_load": size})

    first, again, other = record(1, 0.01), record(1, 0.01), record(2, 0.01)
    assert np.array_equal(first.trajectory.wheel_speed, again.trajectory.wheel_speed)
    assert not np.array_equal(first.trajectory.wheel_speed, other.trajectory.wheel_speed)
    pressures = [
        next(c.values for c in bench.channels if c.role == "pressure.B3")
        for bench in (first, record(1, 0.0))
    ]
    assert np.array_equal(pressures[0], pressures[1])


@pytest.mark.parametrize("scenario", ["input_gear", "manual", "power_off_up"])
def test_other_dual_clutches_take_all_effects(scenario: str) -> None:
    sizes = dict(SIZES)
    del sizes[EffectId.BACKLASH]
    nominal, zero = (
        move(effects, load_scenario(scenario)) for effects in ({}, {"input_drag": 0.0})
    )
    assert np.allclose(zero.engine_speed, nominal.engine_speed, atol=1e-8)
    assert move(sizes, load_scenario(scenario)).status == "completed"


def read(bench: DynoRun) -> FloatArray:
    return next(channel.values for channel in bench.channels if channel.role == "output_torque")


def test_errors_of_the_output_torque_are_those_of_its_sensor_alone() -> None:
    """Offset and drift are shares of the largest shaft torque, the drift over 5 s and without
    mean; a late sample is older."""
    exact = run(SCENARIO, 1, noise=0.0)
    full, found = np.max(np.abs(exact.trajectory.shaft_torque)), {}
    for name, size in (("offset", 0.01), ("drift", 0.01), ("delay", 0.003)):
        bench = run(SCENARIO, 1, noise=0.0, effects={f"output_torque_{name}": size})
        for channel, other in zip(bench.channels, exact.channels, strict=True):
            same = np.array_equal(channel.values, other.values)
            assert same == (channel.role != "output_torque")
        found[name] = read(bench)
    assert np.allclose(found["offset"] - read(exact), 0.01 * full, rtol=1e-3)
    assert np.allclose(found["delay"][3:], read(exact)[:-3], atol=1e-6)
    ends = []
    for seed in range(40):
        drift = read(run(SCENARIO, seed, noise=0.0, effects={"output_torque_drift": 0.01}))
        drift = drift - read(exact)
        assert abs(np.mean(drift)) < 1e-4 * full
        ends.append((drift[-1] - drift[0]) / full)
    # Length 5 s; the standard deviation of 40 draws lies within 30 % in 99 of 100 cases.
    assert np.std(ends) == pytest.approx(0.01, rel=0.3)


def test_a_sensor_effect_needs_its_sensor_and_any_plant_takes_it() -> None:
    sensors = tuple(each for each in SCENARIO.sensors if each.role != "output_torque")
    with pytest.raises(InputError, match="no output torque"):
        run(replace(SCENARIO, sensors=sensors), effects={"output_torque_offset": 0.01})
    bench = run(load_scenario("gearbox"), noise=0.0, effects={"output_torque_offset": 0.01})
    assert bench.truth.effects == {"output_torque_offset": 0.01}
