# SPDX-License-Identifier: MIT
"""Runs over scenarios: independent of chunks and wanted metrics, with the parts of the vehicle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from time import process_time
from typing import Any

import numpy as np
import pytest

from drivetwin.calibration.metrics import Metric, list_outputs
from drivetwin.calibration.options import PolicyKind
from drivetwin.simulation.network import simulate
from drivetwin.simulation.shift_control import SpeedSensor
from tests.calibration.cases import (
    draw,
    make_nominal,
    make_plant,
    make_task,
    make_task_with,
    run_nominal,
    start,
    start_profiles,
)
from tests.calibration.twins import ADDED_ELEMENTS, assemble


def test_chunks_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    task = make_task()
    plant, draws, profiles = make_plant(task.maneuver), draw(task, 7), start(task)
    whole = plant.evaluate(profiles, draws)
    monkeypatch.setattr("drivetwin.calibration.evaluate._CHUNK", 3)
    added = plant.evaluate(profiles, draws)
    for name, values in whole.values.items():
        assert values == pytest.approx(added.values[name], rel=1e-9, abs=1e-9)
    assert plant.count.runs == 14
    few = replace(plant, metrics=(Metric.FLARE,)).evaluate(profiles, draws)
    assert set(few.values) == {Metric.FLARE}


def test_units_about_a_lossless_driveline_run_side_by_side() -> None:
    """A scale of the engine torque is an efficiency: units lie on both sides of 1."""
    task = make_task_with(ADDED_ELEMENTS["tyre"])
    plant, draws, profiles = make_plant(task.maneuver), draw(task, 128), start(task)

    def measure(middle: float) -> float:
        eta = middle * (1.0 + 0.04 * (np.arange(128) % 2 - 0.5))
        units = replace(draws, sets={**draws.sets, "i_in.loss.eta": eta})
        begin = process_time()
        plant.evaluate(profiles, units)
        return process_time() - begin

    assert min(measure(1.0) for _ in range(3)) < 1.4 * min(measure(0.9) for _ in range(3))


def test_late_pressures_move_the_shift_by_their_delay() -> None:
    """With a constant engine torque, a delay of all pressures moves the lock-up."""
    locks = []
    for delay in (0.0, 0.01):
        task = make_task_with({"p_delay": delay})
        task = replace(task, policy=task.policy.set_start({"reduction_depth": 0.0}))
        shift, control = task.maneuver, start(task)
        runs = make_plant(shift).simulate(control, make_nominal(task, control), (shift.body.drive,))
        locks.append(runs.last_lock)
    np.testing.assert_allclose(locks[1] - locks[0], 0.01, rtol=0.1)


@pytest.mark.parametrize("kind", [PolicyKind.CONTROLLER, PolicyKind.SLIP])
@pytest.mark.parametrize("part", list(ADDED_ELEMENTS))
def test_the_predicted_motion_is_that_of_the_whole_network(part: str, kind: PolicyKind) -> None:
    task = make_task_with(ADDED_ELEMENTS[part], kind)
    shift, profiles = task.maneuver, start_profiles(task)
    names = ("engine torque", "B2", "B3")
    inputs = dict(zip(names, profiles.signals.values(), strict=True))
    outputs = list_outputs(shift)
    run = simulate(assemble(shift, ADDED_ELEMENTS[part]), inputs, shift.start, shift.time, outputs)
    assert run.status == "completed"
    for found, expected in zip(run_nominal(task, start(task)), run.columns.values(), strict=True):
        np.testing.assert_allclose(found, expected, atol=2e-4 * np.abs(expected).max())


def compare_with_reduced(values: Mapping[str, float]) -> tuple[list[Any], list[Any]]:
    """Shaft torques (n,) and metrics of the same control with and without a part."""
    tasks = make_task_with(values), make_task()
    control = start(tasks[0])
    nominal = [make_nominal(one, control) for one in tasks]
    metrics = [
        make_plant(one.maneuver).evaluate(control, each).values
        for one, each in zip(tasks, nominal, strict=True)
    ]
    return [run_nominal(one, control)[0] for one in tasks], metrics


@pytest.mark.parametrize(
    ("values", "rel"),
    [
        ({"mode_frequency": 400.0, "mode_share": 0.5, "mode_damping": 0.05}, 0.01),
        ({"tyre_slip": 2e-4, "shaft_reference": 8000.0}, 0.01),
        ({"shaft_progression": 1e-6, "shaft_reference": 8000.0}, 1e-4),
    ],
)
def test_a_stiff_part_changes_nothing(values: dict[str, float], rel: float) -> None:
    _, (whole, reduced) = compare_with_reduced(values)
    for metric in (Metric.PEAK_JERK, Metric.VIBRATION_DOSE, Metric.FRICTION_ENERGY):
        assert whole[metric] == pytest.approx(reduced[metric], rel=rel)


def test_a_soft_input_shaft_lowers_the_jerk_of_lockup() -> None:
    """Half of J1 is behind the input shaft: less inertia stops at the lock-up."""
    _, (whole, reduced) = compare_with_reduced(ADDED_ELEMENTS["input shaft"])
    assert whole[Metric.PEAK_JERK] < 0.8 * reduced[Metric.PEAK_JERK]


@pytest.mark.parametrize("slip", [0.002, 0.01, 0.03])
def test_the_linear_tyre_of_the_search_is_near_the_exact_one(slip: float) -> None:
    """It has a rim at 3 % alone: at the others that lags by less than two samples."""
    task = make_task_with({"tyre_slip": slip, "shaft_reference": 2500.0})
    quick = replace(task, maneuver=task.maneuver.linearise())
    assert [one["name"] for one in quick.maneuver.elements].count("J_v") == (slip == 0.03)
    exact, found = (
        make_plant(one.maneuver).evaluate(start(one), draw(one, 8)).values for one in (task, quick)
    )
    for metric, rel in ((Metric.PEAK_JERK, 0.03), (Metric.VIBRATION_DOSE, 0.04)):
        np.testing.assert_allclose(found[metric], exact[metric], rtol=rel)


def test_play_acts_from_the_reversal_of_the_torque_on() -> None:
    (torque, reduced), (whole, other) = compare_with_reduced(ADDED_ELEMENTS["backlash"])
    reversal = int(np.argmax(reduced < 0.0))
    assert 0 < reversal < reduced.size
    np.testing.assert_allclose(torque[:reversal], reduced[:reversal], atol=1e-3)
    assert not torque[reversal : reversal + 4].any()
    assert whole[Metric.PEAK_JERK] > other[Metric.PEAK_JERK]


def test_inputs_of_a_closed_loop_are_those_of_its_nominal_profiles() -> None:
    task = make_task(policy=PolicyKind.SLIP)
    shift, control, profiles = task.maneuver, start(task), start_profiles(task)
    found = make_plant(shift).evaluate(control, make_nominal(task, control)).values
    depth = np.abs(profiles.engine_torque.values - shift.point.engine_torque).max()
    rates = [np.abs(np.diff(one.values)).max() for one in (profiles.offgoing, profiles.oncoming)]
    assert depth > 0.0
    assert found[Metric.TORQUE_REDUCTION] == pytest.approx([depth])
    assert found[Metric.PRESSURE_RATE] == pytest.approx([max(rates) / shift.step])


def test_a_controller_has_the_speeds_of_the_sensors() -> None:
    """The intervention begins where the slip of the off-going element is seen."""
    task = make_task(policy=PolicyKind.SLIP, sensors={"engine_speed": SpeedSensor()})
    shift, control, draws = task.maneuver, start(task), draw(task, 3)

    def run(**given: float) -> tuple[Any, Any]:
        sensors = [one.sensors for one in draws.units]
        changed = [replace(one, output=SpeedSensor(**given), engine=SpeedSensor(**given))
                   for one in sensors]  # fmt: skip
        units = [replace(a, sensors=b) for a, b in zip(draws.units, changed, strict=True)]
        found = make_plant(shift).simulate(
            control, replace(draws, units=units), list_outputs(shift)
        )
        assert found.inputs is not None
        command = found.inputs[:, 3]
        return command, shift.time[(command != command[:, :1]).argmax(axis=1)]

    bare = replace(draws, units=[replace(one, sensors=None) for one in draws.units])
    expected = make_plant(shift).simulate(control, bare, list_outputs(shift)).inputs
    exact, begin = run()
    assert expected is not None
    np.testing.assert_allclose(exact, expected[:, 3], atol=1e-6)
    np.testing.assert_allclose(run(delay=0.01)[1], begin + 0.01, atol=2e-3)
    assert (np.ptp(run(quantum=1e4)[0], axis=1) == 0.0).all()
    noisy, again = run(noise=0.3)[0], run(noise=0.3)[0]
    np.testing.assert_array_equal(noisy, again)
    # The intervention ramps in two tasks; noise moves its start by one of them.
    assert 0.0 < np.abs(noisy - exact).max() <= 0.5 * np.ptp(exact)
    assert (run(period=0.04)[1] >= begin).all()
