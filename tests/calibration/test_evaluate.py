# SPDX-License-Identifier: MIT
"""Runs over scenarios: independent of chunks and wanted metrics, with the parts of the vehicle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from drivetwin.calibration import evaluate
from drivetwin.calibration.calibrate import Task, draw_for
from drivetwin.calibration.identified_range import simulate_nominal
from drivetwin.calibration.input_path import InputPath
from drivetwin.calibration.maneuver import Maneuver
from drivetwin.calibration.metrics import Metric, Outcome, list_outputs
from drivetwin.calibration.policies.controller import build_controller_policy
from drivetwin.calibration.policies.kind import PolicyKind
from drivetwin.calibration.policy import Space
from drivetwin.calibration.profiles import ClosedLoop, compute_nominal_profiles
from drivetwin.calibration.scenarios import Purpose, collect_scenarios
from drivetwin.calibration.twin_task import Request, build_task
from drivetwin.simulation.added_elements import NO_ADDED_ELEMENTS
from drivetwin.simulation.dual_clutch import ENGINE_TORQUE
from drivetwin.simulation.network import simulate
from tests.calibration.cases import (
    QUICK,
    SYSTEM,
    make_draws,
    make_plant,
    make_slip_task,
    make_upshift,
)
from tests.calibration.twins import ADDED_ELEMENTS, assemble, extend_twin, make_hydraulic_twin
from tests.support.arrays import FloatArray


def test_chunks_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    shift = make_upshift(step=2e-3)
    space, plant, draws = (
        Space(build_controller_policy(shift, SYSTEM)),
        make_plant(shift),
        make_draws(shift, 7),
    )
    profiles = space.build_control(space.start)
    whole = plant.evaluate(profiles, draws)
    monkeypatch.setattr(evaluate, "_CHUNK", 3)
    added = plant.evaluate(profiles, draws)
    for name, values in whole.values.items():
        assert values == pytest.approx(added.values[name], rel=1e-9, abs=1e-9)
    assert plant.count.runs == 14
    few = replace(plant, metrics=(Metric.FLARE,)).evaluate(profiles, draws)
    assert set(few.values) == {Metric.FLARE}
    assert np.array_equal(few.jerk.shape, whole.jerk.shape)


def test_late_pressures_move_the_shift_by_their_delay() -> None:
    """With a constant engine torque, a delay of all pressures moves the lock-up."""
    shift = make_upshift()
    policy = build_controller_policy(shift, SYSTEM).set_start({"reduction_depth": 0.0})
    space = Space(policy)
    control = space.build_control(space.start)
    locks = []
    for delay in (0.0, 0.01):
        late = replace(shift, path=InputPath(pressure_delay=delay))
        plant, draws = make_plant(late), make_draws(shift, 4)
        locks.append(plant.simulate(control, draws, (shift.body.drive,)).last_lock)
    np.testing.assert_allclose(locks[1] - locks[0], 0.01, rtol=0.1)


def make_task(values: Mapping[str, float], kind: PolicyKind = PolicyKind.CONTROLLER) -> Task:
    """Task of a twin with the parameters of a part."""
    twin = extend_twin(make_hydraulic_twin(), values)
    return build_task(twin, Request(gears=("2", "3"), policy=kind, limits=(), settings=QUICK))


@pytest.mark.parametrize("kind", [PolicyKind.CONTROLLER, PolicyKind.SLIP])
@pytest.mark.parametrize("part", list(ADDED_ELEMENTS))
def test_the_predicted_motion_is_that_of_the_whole_network(part: str, kind: PolicyKind) -> None:
    task = make_task(ADDED_ELEMENTS[part], kind)
    shift, space = task.maneuver, Space(task.policy)
    control = space.build_control(space.start)
    drawn = draw_for(task, 1, Purpose.SEARCH)
    nominal = replace(collect_scenarios(shift, [shift.driveline]), units=drawn.units)
    if isinstance(control, ClosedLoop):
        nominal = replace(nominal, units=[control.unit])
    columns = make_plant(shift).simulate(control, nominal, list_outputs(shift)).columns
    profiles = compute_nominal_profiles(shift, control)
    inputs = {
        ENGINE_TORQUE: profiles.engine_torque,
        "B2": profiles.offgoing,
        "B3": profiles.oncoming,
    }
    elements, start = assemble(shift, ADDED_ELEMENTS[part]), shift.start
    run = simulate(elements, inputs, start, shift.time, list_outputs(shift))
    assert run.status == "completed"
    for column, expected in zip(columns[0], run.columns.values(), strict=True):
        size = np.abs(expected).max()
        np.testing.assert_allclose(column, expected, atol=2e-4 * size)
    found = simulate_nominal(shift, profiles)
    np.testing.assert_allclose(
        found.shaft_torque, columns[0, 0], atol=2e-4 * np.abs(columns[0, 0]).max()
    )


def compare_with_reduced(
    values: Mapping[str, float],
) -> tuple[tuple[FloatArray, Outcome], tuple[FloatArray, Outcome]]:
    """Shaft torque (n,) and metrics of the same control with and without a part."""
    shift = make_task(values).maneuver
    space = Space(build_controller_policy(shift, SYSTEM))
    control = space.build_control(space.start)

    def run(one: Maneuver) -> tuple[FloatArray, Outcome]:
        plant, nominal = make_plant(one), collect_scenarios(one, [one.driveline])
        columns = plant.simulate(control, nominal, list_outputs(one)).columns
        return columns[0, 0], plant.evaluate(control, nominal)

    return run(shift), run(replace(shift, added=NO_ADDED_ELEMENTS))


@pytest.mark.parametrize(
    ("values", "rel"),
    [
        ({"mode_frequency": 400.0, "mode_share": 0.5, "mode_damping": 0.05}, 0.01),
        ({"tyre_slip": 2e-4, "shaft_reference": 8000.0}, 0.01),
        ({"shaft_progression": 1e-6, "shaft_reference": 8000.0}, 1e-4),
    ],
)
def test_a_stiff_part_changes_nothing(values: dict[str, float], rel: float) -> None:
    (_, whole), (_, reduced) = compare_with_reduced(values)
    for metric in (Metric.PEAK_JERK, Metric.VIBRATION_DOSE, Metric.FRICTION_ENERGY):
        assert whole.values[metric] == pytest.approx(reduced.values[metric], rel=rel)


def test_a_soft_input_shaft_lowers_the_jerk_of_lockup() -> None:
    """Half of J1 is behind the input shaft: less inertia stops at the lock-up."""
    (_, whole), (_, reduced) = compare_with_reduced(ADDED_ELEMENTS["input shaft"])
    assert whole.values[Metric.PEAK_JERK] < 0.8 * reduced.values[Metric.PEAK_JERK]


def test_play_acts_from_the_reversal_of_the_torque_on() -> None:
    (torque, whole), (reduced, other) = compare_with_reduced(ADDED_ELEMENTS["backlash"])
    reversal = int(np.argmax(reduced < 0.0))
    assert 0 < reversal < reduced.size
    np.testing.assert_allclose(torque[:reversal], reduced[:reversal], atol=1e-3)
    assert not torque[reversal : reversal + 4].any()
    assert whole.values[Metric.PEAK_JERK] > other.values[Metric.PEAK_JERK]


def test_inputs_of_a_closed_loop_are_those_of_its_nominal_profiles() -> None:
    task = make_slip_task()
    shift, space = task.maneuver, Space(task.policy)
    control = space.build_control(space.start)
    assert isinstance(control, ClosedLoop)
    nominal = replace(collect_scenarios(shift, [shift.driveline]), units=[control.unit])
    found = make_plant(shift).evaluate(control, nominal).values
    profiles = compute_nominal_profiles(shift, control)
    depth = np.abs(profiles.engine_torque.values - shift.point.engine_torque).max()
    rates = [np.abs(np.diff(one.values)).max() for one in (profiles.offgoing, profiles.oncoming)]
    assert depth > 0.0
    assert found[Metric.TORQUE_REDUCTION] == pytest.approx([depth])
    assert found[Metric.PRESSURE_RATE] == pytest.approx([max(rates) / shift.step])
