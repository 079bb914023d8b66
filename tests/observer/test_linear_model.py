# SPDX-License-Identifier: MIT
"""The linear model with known locks against the core's own run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.observer.linear_model import (
    ENGINE,
    LOAD,
    OUTPUT,
    STATES,
    TORQUE_ERROR,
    TWIST,
    WHEEL,
    Course,
    build_linear_model,
)
from drivetwin.simulation.driveline_run import simulate
from drivetwin.simulation.dual_clutch import DualClutch, Signal, Trajectory

GRID = 2e-4


def _run(model: DualClutch) -> tuple[Trajectory, Signal]:
    scenario = load_scenario("paper_steps")
    grid = np.arange(int(scenario.duration * 1000) + 1) / 1000.0
    torque = Signal(grid, scenario.compute_torque(grid))
    pressures = {n: Signal(grid, a.compute_pressure(grid)) for n, a in scenario.actuators.items()}
    time = 0.5 * GRID * np.arange(2 * round(3.2 / GRID) + 1, dtype=np.float64)
    run = simulate(model, torque, pressures, scenario.start(), time)
    assert run.status == "completed"
    return run, torque


@pytest.mark.parametrize("drum", [0.0, 0.05])
def test_follows_the_core_through_all_phases(drum: float) -> None:
    """Given what slipping elements carry, each step ends where the core's does."""
    model = load_scenario("paper_steps").model
    model = replace(
        model, elements=tuple(replace(one, drum_inertia=drum) for one in model.elements)
    )
    run, torque = _run(model)
    middle = run.time[1::2]
    locks = {event.element: event.time for event in run.events if event.kind == "lock"}
    breaks = {event.element: event.time for event in run.events if event.kind == "break_away"}
    locked = {"B2": middle < breaks["B2"], "B3": middle > locks["B3"]}
    # The mean over a step by Simpson's rule.
    carried = {n: (t[:-2:2] + 4.0 * t[1::2] + t[2::2]) / 6.0 for n, t in run.clutch_torque.items()}
    base = {n: np.where(locked[n], 0.0, carried[n]) for n in carried}
    none = {n: np.zeros(middle.size) for n in base}
    time = run.time[::2]
    acting = np.interp(middle, torque.time, torque.values)
    course = Course(time, acting, acting >= 0.0, locked, base, none, 100.0)
    found = build_linear_model(model, course)
    x = np.zeros((time.size, STATES))
    x[:, ENGINE], x[:, OUTPUT] = run.engine_speed[::2], run.output_speed[::2]
    x[:, WHEEL], x[:, TWIST] = run.wheel_speed[::2], run.twist[::2]
    x[:, LOAD] = model.load.constant
    ahead = np.einsum("kij,kj->ki", found.transition, x[:-1]) + found.push
    near = np.zeros(middle.size, dtype=bool)
    for event in run.events:
        near |= np.abs(middle - event.time) < GRID
    miss = np.abs(ahead - x[1:])[~near]
    # Torques are constant over a step in the linear model: an error of third order in the step.
    assert miss[:, :TWIST].max() < 2e-5
    assert model.k_o * miss[:, TWIST].max() < 0.02
    for name, torques in carried.items():
        told = np.einsum("ki,ki->k", found.rows[name], 0.5 * (x[1:] + x[:-1]))
        told = told + found.constants[name]
        assert told[~near] == pytest.approx(torques[~near], abs=0.5)


def test_the_dissipative_law_divides_by_eta_where_power_flows_back() -> None:
    """Whichever sign the engine's own torque has: while it is slowed down it drives."""
    model = replace(load_scenario("paper_steps").model, loss_law="dissipative", J2e=2.2)
    time = np.array([0.0, 1e-3, 2e-3])
    off = {one.name: np.zeros(2, dtype=bool) for one in model.elements}
    none = {name: np.zeros(2) for name in off}
    driving = np.array([True, False])
    found = build_linear_model(
        model, Course(time, np.full(2, -500.0), driving, off, none, none, 100.0)
    )
    for share, push, transition in zip(
        (model.eta, 1.0 / model.eta), found.push, found.transition, strict=True
    ):
        inertia = share * model.J1 + model.J2e
        assert push[ENGINE] == pytest.approx(-500.0 * share / inertia * 1e-3)
        # The error of the engine torque is forgotten at 100/s: its mean over a step is less.
        mean = (1.0 - np.exp(-0.1)) / 0.1
        assert transition[ENGINE, TORQUE_ERROR] == pytest.approx(share / inertia * 1e-3 * mean)
