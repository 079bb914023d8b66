# SPDX-License-Identifier: MIT
"""The linear response against differences of the core's runs, through break-away and lock."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin.dyno import ScenarioName
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.likelihood.motion import simulate_motion
from drivetwin.simulation.dual_clutch import Signal
from tests.estimation.likelihood.fixtures import ROUGH, bench, problem
from tests.support.bench import record_bench


@pytest.mark.parametrize("name", ["engine torque", "B3"])
def test_disturbed_inputs_move_the_run_as_the_response_says(name: str) -> None:
    posed, point = problem(bench(noise=0.0))
    term = posed.terms[0]
    base = simulate_motion(term, point)
    assert base is not None
    shift = bench(noise=0.0).signals.shift
    size, start = (0.5, 3.0) if name == "engine torque" else (50.0, shift.inertia_phase[0] + 0.05)

    def bump(
        time: np.ndarray[tuple[int], np.dtype[np.float64]],
    ) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        return size * np.asarray((time > start) & (time < start + 0.2), dtype=float)

    inputs = dict(term.record.inputs)
    old = inputs[name]
    new = Signal(old.time, old.values + bump(old.time))
    record = replace(term.record, inputs={**inputs, name: new})
    run = simulate_motion(replace(term, record=record), point)
    assert run is not None
    middle = 0.5 * (base.time[1:] + base.time[:-1])
    change = np.interp(middle, new.time, new.values - old.values)
    expected = term.observe(term.compute_response(point), {name: change})
    found = term.record.sample_run(run) - term.record.sample_run(base)
    near_lock = np.abs(
        np.concatenate([base.time[out.place] for out in term.record.outputs]) - shift.lockup_time
    )
    clear = near_lock > 0.003
    weight = clear / term.record.sigma
    miss = np.linalg.norm((found - expected) * weight) / np.linalg.norm(found * weight)
    assert miss < 0.03


@pytest.mark.parametrize("law", ["paper", "dissipative"])
@pytest.mark.parametrize("name", [ScenarioName.POWER_OFF_UP, ScenarioName.POWER_OFF_DOWN], ids=str)
def test_the_engine_torque_acts_by_the_loss_law(name: ScenarioName, law: Any) -> None:
    """The engine torque moves the run by 1/η where power flows back and the law says so."""
    scenario = load_scenario(name)
    scenario = replace(scenario, model=replace(scenario.model, loss_law=law))
    made = record_bench(scenario, 0, ROUGH, 0.0)
    posed, point = problem(made)
    term, shift = posed.terms[0], made.signals.shift
    base = simulate_motion(term, point)
    assert base is not None
    old, age = term.record.engine_torque, term.plant.get_value(point, "te_delay")
    middle = 0.5 * (base.time[1:] + base.time[:-1])
    time = np.concatenate([base.time[out.place] for out in term.record.outputs])
    clear = np.abs(time - shift.lockup_time) > 0.003
    spans = (
        (shift.torque_phase[0] - 0.6, 0.4),
        (shift.inertia_phase[0] + 0.05, 0.2),
        (shift.lockup_time + 0.1, 0.3),
    )
    for start, length in spans:
        bump = 0.5 * ((old.time > start) & (old.time < start + length))
        torque = Signal(old.time, old.values + bump)
        moved = replace(term.record, inputs={**term.record.inputs, "engine torque": torque})
        run = simulate_motion(replace(term, record=moved), point)
        assert run is not None
        change = np.interp(middle + age, old.time, bump)
        expected = term.observe(term.compute_response(point), {"engine torque": change})
        found = term.record.sample_run(run) - term.record.sample_run(base)
        weight = clear / term.record.sigma
        miss = np.linalg.norm((found - expected) * weight) / np.linalg.norm(found * weight)
        assert miss < 0.07


@pytest.mark.parametrize("level", [0.97, 0.99, 1.01, 1.03])
def test_no_slip_is_left_over_wherever_in_a_step_the_element_locks(level: float) -> None:
    posed, point = problem(bench(noise=0.0))
    values = point.values.copy()
    values[point.names.index("B3.mu_c")] *= level
    point, term = point.replace_values(values), posed.terms[0]
    run = simulate_motion(term, point)
    assert run is not None
    lock = next(event.time for event in run.events if event.kind == "lock")
    model = term.plant.build_model(point)
    element = next(one for one in model.elements if one.name == "B3")
    disturbance = {"engine torque": np.ones(run.time.size - 1)}
    z = term.compute_response(point).propagate_inputs(disturbance)
    slip = z[:, 0] / element.i_c - element.i_out * z[:, 1]
    assert np.max(np.abs(slip)) > 1e-2
    assert np.max(np.abs(slip[run.time > lock])) < 1e-12
