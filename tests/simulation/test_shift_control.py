# SPDX-License-Identifier: MIT
"""Shifts in closed loop: the actuators and the driveline of the core, and what is refused."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.actuator.model import ActuatorModel, HeldSignal
from drivetwin.calibration.options import PolicyKind
from drivetwin.errors import InputError
from drivetwin.simulation.driveline_run import simulate
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import Output, build_element
from drivetwin.simulation.network import simulate as simulate_network
from drivetwin.simulation.shift_control import (
    INPUTS,
    ControlledBatch,
    ControlledNetwork,
    ControlledUnit,
    simulate_network_controlled,
)
from tests.calibration.cases import make_task
from tests.calibration.twins import make_exact_twin
from tests.support.arrays import FloatArray

TASK = make_task(twin=make_exact_twin(), policy=PolicyKind.SLIP)
SHIFT, POLICY = TASK.maneuver, cast(Any, TASK.policy)
CONTROLLER = POLICY.base
OUTPUTS: list[Output] = [("shaft_torque", "output shaft"), ("slip", "B2"), ("slip", "B3")]
ACTUATORS = st.builds(
    ActuatorModel,
    dead_time=st.floats(0.0, 0.05),
    rising_lag=st.floats(2e-3, 0.08),
    falling_lag=st.floats(2e-3, 0.08),
    damping=st.one_of(st.floats(0.3, 2.0), st.just(1.0)),
    kiss_pressure=st.floats(0.5e5, 2e5),
    fill_time=st.one_of(st.just(0.0), st.floats(0.01, 0.15)),
    hysteresis=st.floats(0.0, 3e4),
)


def make_network(
    units: Sequence[ControlledUnit], parameters: Mapping[str, FloatArray] | None = None
) -> ControlledNetwork:
    """The shift with numbers (units,) that change by path."""
    return ControlledNetwork(SHIFT.elements, SHIFT.start, units, parameters or {})


def run(unit: ControlledUnit, step: float = 1e-3) -> ControlledBatch:
    shift = SHIFT.set_step(step)
    return simulate_network_controlled(
        make_network([unit]), [CONTROLLER], shift.time, OUTPUTS, with_inputs=True, threads=1
    )


@given(ACTUATORS, ACTUATORS, st.sampled_from([1e-3, 2e-3]))
def test_pressures_follow_commands_as_the_actuator_model_says(
    old: ActuatorModel, new: ActuatorModel, step: float
) -> None:
    batch = run(ControlledUnit(old, new, 0.05), step)
    time = SHIFT.set_step(step).time
    columns = dict(zip(INPUTS, batch.inputs[0, 0], strict=True))
    tasks = slice(None, None, round(CONTROLLER.task / step))
    for name, model in (("offgoing", old), ("oncoming", new)):
        # The command at a sample has held until it.
        held = HeldSignal(time[tasks][:-1], columns[f"command.{name}"][1:][tasks])
        expected = model.compute_pressure(held, time)
        assert columns[f"pressure.{name}"] == pytest.approx(expected, abs=1.0)


def test_motion_is_that_of_the_same_inputs_without_controller() -> None:
    batch = run(POLICY.unit)
    columns = dict(zip(INPUTS, batch.inputs[0, 0], strict=True))
    signals = {name: Signal(SHIFT.time, values) for name, values in columns.items()}
    pressures = {"B2": signals["pressure.offgoing"], "B3": signals["pressure.oncoming"]}
    start = SHIFT.build_start()
    exact = simulate(SHIFT.model, signals["engine_torque"], pressures, start, SHIFT.time)
    assert not batch.failed
    largest = np.abs(exact.shaft_torque).max()
    assert batch.values[0, 0, 0] == pytest.approx(exact.shaft_torque, abs=1e-5 * largest)
    assert batch.values[0, 0, 2] == pytest.approx(exact.slip["B3"], abs=1e-4)
    locks = [one.time for one in exact.events if one.kind == "lock" and one.element == "B3"]
    assert batch.last_lock[0, 0] == pytest.approx(locks[-1], abs=1e-6)


def test_runs_do_not_depend_on_their_neighbours_and_threads() -> None:
    units = [replace(POLICY.unit, engine_lag=lag) for lag in (0.02, 0.05, 0.1)]
    gains = SHIFT.oncoming.gain * np.array([0.95, 1.0, 1.05])
    controllers = [CONTROLLER, replace(CONTROLLER, gain=2.0 * CONTROLLER.gain)]
    whole = make_network(units, {"B3.gain": gains})
    together = simulate_network_controlled(whole, controllers, SHIFT.time, OUTPUTS)
    for k, unit in enumerate(units):
        one = replace(whole, units=[unit], parameters={"B3.gain": gains[k : k + 1]})
        alone = simulate_network_controlled(one, controllers[1:], SHIFT.time, OUTPUTS, threads=1)
        assert np.array_equal(alone.values[0, 0], together.values[k, 1])
        assert alone.last_lock[0, 0] == together.last_lock[k, 1]


def test_what_makes_no_batch_is_refused() -> None:
    plant = make_network([POLICY.unit])
    with pytest.raises(InputError, match="make no batch"):
        simulate_network_controlled(plant, [], SHIFT.time, OUTPUTS)
    other = replace(CONTROLLER, request=0.2)
    with pytest.raises(InputError, match="make no batch"):
        simulate_network_controlled(plant, [CONTROLLER, other], SHIFT.time, OUTPUTS)
    wrong = replace(plant, parameters={"B9.gain": np.ones(1)})
    with pytest.raises(InputError, match="unknown"):
        simulate_network_controlled(wrong, [CONTROLLER], SHIFT.time, OUTPUTS)
    for changed, text in (
        (replace(CONTROLLER, oncoming="B4"), 'clutch "B4" is unknown; known are B2, B3'),
        (replace(CONTROLLER, gain=float("nan")), "not a finite number"),
    ):
        with pytest.raises(InputError, match=text):
            simulate_network_controlled(plant, [changed], SHIFT.time, OUTPUTS)
    with pytest.raises(InputError, match="controller task"):
        replace(CONTROLLER, task=0.0)
    with pytest.raises(InputError, match="engine lag"):
        replace(POLICY.unit, engine_lag=-1.0)


def test_other_inputs_act_as_given() -> None:
    gains = SHIFT.oncoming.gain * np.array([0.95, 1.05])
    network = make_network([POLICY.unit] * 2, {"B3.gain": gains})
    middle = 0.5 * (SHIFT.time[0] + SHIFT.time[-1])
    times = np.array([SHIFT.time[0], middle, middle + 0.01, SHIFT.time[-1]])
    brake = Signal(times, np.array([0.0, 0.0, -500.0, -500.0]))
    elements = [*network.elements, build_element("torque", "brake", node="wheel", input="M")]
    jump = replace(brake, time=times[[0, 1, 1, 3]])
    with pytest.raises(InputError, match="'M' jumps"):
        simulate_network_controlled(
            replace(network, elements=elements, inputs={"M": jump}),
            [CONTROLLER], SHIFT.time, OUTPUTS,
        )  # fmt: skip
    network = replace(network, elements=elements, inputs={"M": brake})
    batch = simulate_network_controlled(
        network, [CONTROLLER], SHIFT.time, OUTPUTS, with_inputs=True
    )
    assert not batch.failed
    columns = dict(zip(INPUTS, batch.inputs[0, 0], strict=True))
    given = {"engine torque": "engine_torque", "B2": "pressure.offgoing", "B3": "pressure.oncoming"}
    inputs = {name: Signal(SHIFT.time, columns[column]) for name, column in given.items()}
    lighter = [
        {**one, "gain": network.parameters["B3.gain"][0]} if one["name"] == "B3" else one
        for one in elements
    ]
    run = simulate_network(lighter, {**inputs, "M": brake}, network.start, SHIFT.time, OUTPUTS)
    torque = run.columns[OUTPUTS[0]]
    assert batch.values[0, 0, 0] == pytest.approx(torque, abs=1e-5 * np.abs(torque).max())


def test_a_network_without_what_is_controlled_is_refused() -> None:
    gains = SHIFT.oncoming.gain * np.array([0.95, 1.05])
    network = make_network([POLICY.unit] * 2, {"B3.gain": gains})
    changed = replace(network, parameters={"B3.gian": np.ones(2)})
    with pytest.raises(InputError, match="did you mean 'gain'"):
        simulate_network_controlled(changed, [CONTROLLER], SHIFT.time, OUTPUTS)
    other = replace(CONTROLLER, oncoming="load")
    inputs = {"B3": Signal(SHIFT.time, np.zeros(SHIFT.time.size))}
    with pytest.raises(InputError, match='clutch "load" is unknown; known are B2, B3'):
        simulate_network_controlled(replace(network, inputs=inputs), [other], SHIFT.time, OUTPUTS)
