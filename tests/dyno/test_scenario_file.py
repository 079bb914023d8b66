# SPDX-License-Identifier: MIT
"""The built-in scenarios are the upshifts they are said to be."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.dyno import ScenarioName
from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.errors import InputError

DUAL = (ScenarioName.PAPER, ScenarioName.PAPER_STEPS, ScenarioName.THROTTLE_STEPS)


@pytest.fixture(scope="module", params=DUAL)
def bench(request: pytest.FixtureRequest) -> DynoRun:
    return run(load_scenario(request.param), noise=0.0)


def test_phases_come_in_the_order_of_a_power_on_upshift(bench: DynoRun) -> None:
    truth = bench.truth
    assert truth.torque_start is not None
    assert truth.inertia_start is not None
    assert truth.lockup is not None
    assert 0.05 < truth.inertia_start - truth.torque_start < 0.25
    assert 0.25 < truth.lockup - truth.inertia_start < 0.7
    assert bench.scenario.duration - truth.lockup > 1.5


def test_on_coming_element_locks_once_and_before_its_pressure_rises_to_main(
    bench: DynoRun,
) -> None:
    scenario, lockup = bench.scenario, bench.truth.lockup
    kinds = [e.kind for e in bench.trajectory.events if e.element == scenario.oncoming]
    assert kinds.count("lock") == 1
    assert "break_away" not in kinds
    final_ramp, _ = scenario.actuators[scenario.oncoming].command.knots[-2]
    assert lockup is not None
    assert lockup < final_ramp


def test_output_torque_dips_in_the_torque_phase_and_rises_in_the_inertia_phase(
    bench: DynoRun,
) -> None:
    time, torque = bench.trajectory.time, bench.trajectory.shaft_torque
    start, slip, lock = bench.truth.torque_start, bench.truth.inertia_start, bench.truth.lockup
    assert start is not None
    assert slip is not None
    assert lock is not None
    before = np.mean(torque[(time > start - 0.05) & (time < start)])
    assert torque[(time > start) & (time < slip + 0.03)].min() < 0.85 * before
    assert np.mean(torque[(time > slip + 0.1) & (time < lock)]) > 1.3 * before


def test_start_is_quasi_steady(bench: DynoRun) -> None:
    early = bench.trajectory.time < 0.25
    torque = bench.trajectory.shaft_torque[early]
    assert np.ptp(torque) < 1e-3 * torque.mean()


def test_paper_truth_is_the_published_set() -> None:
    values = run(load_scenario("paper"), noise=0.0).truth.parameters
    assert values["eta"] == 0.85
    assert values["J_prime_2"] == pytest.approx(17.50, abs=0.005)
    assert values["J_prime_3"] == pytest.approx(17.69, abs=0.01)
    assert values["Tv_over_if"] == pytest.approx(2300.0)
    assert values["J_vehicle"] == 6056.0
    assert values["f_d_3"] == pytest.approx(12.0, abs=0.01)


def test_lockup_oscillation_rings_at_its_closed_form_frequency(bench: DynoRun) -> None:
    """Zero crossings of the detrended shaft torque after lock-up against eq. 14."""
    lockup = bench.truth.lockup
    assert lockup is not None
    time, torque = bench.trajectory.time, bench.trajectory.shaft_torque
    ring = (time > lockup + 0.02) & (time < lockup + 0.45)
    t, y = time[ring], torque[ring] - np.mean(torque[time > lockup + 1.2])
    rising = np.flatnonzero((y[:-1] < 0.0) & (y[1:] >= 0.0))
    crossings = t[rising] - y[rising] * (t[rising + 1] - t[rising]) / (y[rising + 1] - y[rising])
    frequency = bench.truth.parameters[f"f_d_{bench.truth.shifts[0].end_gear}"]
    assert 1.0 / np.mean(np.diff(crossings)) == pytest.approx(frequency, rel=0.02)


def test_torque_reduction_shortens_the_inertia_phase() -> None:
    whole = load_scenario("paper")
    reduced = whole.set_torque_reduction(0.4)
    plain, cut = (run(scenario, noise=0.0) for scenario in (whole, reduced))
    torque = next(c for c in cut.channels if c.role == "engine_torque")
    assert torque.values.min() == pytest.approx(0.6 * 1545.0)
    assert plain.truth.lockup is not None
    assert cut.truth.lockup is not None
    assert cut.truth.lockup < plain.truth.lockup - 0.02


@pytest.mark.parametrize(("name", "drum"), [("paper", 0.05), ("gearbox", -0.1)])
def test_a_drum_needs_a_gearbox(name: str, drum: float) -> None:
    with pytest.raises(InputError, match="gearbox, gearbox_chain"):
        load_scenario(ScenarioName(name), drum)


@pytest.mark.parametrize("scenario", ["power_on_down", "power_off_down"])
def test_a_downshift_brings_the_engine_up(scenario: str) -> None:
    made = run(load_scenario(scenario), noise=0.0)
    (shift,), motion = made.truth.shifts, made.trajectory
    assert (shift.start_gear, shift.end_gear) == ("3", "2")
    start, end = shift.inertia_start or 0.0, shift.lockup or 0.0
    speeds = np.interp([start, end], motion.time, motion.engine_speed)
    assert speeds[1] > 1.05 * speeds[0]
    if scenario == "power_on_down":  # the element that lets go carries the torque
        middle = start + 0.4
        torques = {n: np.interp(middle, motion.time, t) for n, t in motion.clutch_torque.items()}
        assert torques["B3"] > 50.0
        assert torques["B2"] == 0.0


def test_with_the_power_off_the_engine_falls_before_the_upshift_takes_hold() -> None:
    made = run(load_scenario("power_off_up"), noise=0.0)
    assert (made.truth.torque_start or 0.0) > (made.truth.inertia_start or 0.0) > 0.0
    assert made.scenario.compute_torque(np.array([2.2]))[0] < 0.0


def test_an_input_gear_stands_between_engine_and_gearbox() -> None:
    made = run(load_scenario("input_gear"), noise=0.0)
    speed = next(c for c in made.channels if c.role == "input_speed")
    expected = np.interp(speed.time, made.trajectory.time, made.trajectory.engine_speed) / 1.2
    assert speed.values == pytest.approx(expected, rel=1e-9)
    assert made.truth.parameters["J_prime_2"] > 0.85 * 17.0 + 2.2


def test_the_dual_clutch_gearbox_hands_over_without_a_gap_and_the_manual_one_with() -> None:
    made = run(load_scenario("dual_clutch"), noise=0.0)
    motion = made.trajectory
    start, end = made.truth.torque_start or 0.0, made.truth.lockup or 0.0
    between = (motion.time > start) & (motion.time < end)
    assert motion.shaft_torque[between].mean() > 300.0
    made = run(load_scenario("manual"), noise=0.0)
    (pressure,) = [one for one in made.channels if one.role.startswith("pressure.")]
    open_ = (pressure.time > 2.35) & (pressure.time < 2.60)
    assert pressure.values[open_].max() < 1e4 < 1e6 < pressure.values[[0, -1]].min()
    motion = made.trajectory
    gap = (motion.time > 2.45) & (motion.time < 2.60)
    assert np.abs(motion.shaft_torque[gap]).max() < 5.0
