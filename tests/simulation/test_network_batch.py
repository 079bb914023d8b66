# SPDX-License-Identifier: MIT
"""Batches of networks: each run what it is alone, with its exact derivatives."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import Element, Keep, Output, Sine, Start, build_element, simulate
from drivetwin.simulation.network_response import (
    NetworkScenario,
    differentiate_network_batch,
    simulate_network_batch,
)
from drivetwin.simulation.network_sensitivity import differentiate
from tests.support.arrays import FloatArray

TIME: FloatArray = np.linspace(0.0, 1.0, 1001)
FRICTION = {"mu_c": 0.11, "mu_s": 0.13, "v_s": 8.0, "mu_v": 1e-4}


def clutch(name: str, a: str, b: str, gain: float) -> Element:
    """A wet clutch."""
    law = {"friction": FRICTION, "gain": gain, "p0": 8e4, "peak": 1.0}
    return build_element("clutch", name, a=a, b=b, **law, pressure=f"P {name}", drum_inertia=0.0)


def hybrid(*, shaft: bool, tyre: bool = False) -> list[Element]:
    """A hybrid whose K0 starts the engine while K1 slips, of more than 4 states with a shaft.

    A tyre in place of the shaft has no propagators.
    """
    out = "gearbox" if shaft or tyre else "vehicle"
    elements = [
        build_element("inertia", "engine", node="crank", inertia=0.18),
        build_element("torque", "drag", node="crank", input="T engine"),
        clutch("K0", "crank", "rotor", 9e-4),
        build_element("inertia", "rotor", node="rotor", inertia=0.06),
        build_element("torque", "motor", node="rotor", input="T motor"),
        clutch("K1", "rotor", out, 1.2e-3),
        build_element("inertia", "vehicle", node="vehicle", inertia=3.0),
        build_element(
            "road_load", "load", node="vehicle", constant=20.0, rolling=0.0, aero=1e-4
        ),
    ]  # fmt: skip
    if shaft or tyre:
        elements.append(build_element("inertia", "gearbox", node="gearbox", inertia=0.04))
    if tyre:
        slip = {"slip_stiffness": 2e4, "least_speed": 0.5}
        elements.append(build_element("tyre", "tyre", a="gearbox", b="vehicle", **slip))
    if shaft:
        elements += [
            build_element(
                "spring_damper", "axle", a="gearbox", b="vehicle", stiffness=9e3, damping=6.0
            ),
        ]  # fmt: skip
    return elements


def scenario(*, shaft: bool, tyre: bool = False, seed: int = 0) -> NetworkScenario:
    """K0 engages from 0.1 s on."""
    rng = np.random.default_rng(seed)
    pressure = np.interp(TIME, [0.0, 0.1, 0.3, 0.9], [0.0, 1e5, 4e5, 1.2e6])
    torque = np.interp(TIME, [0.0, 0.6, 0.7], [-12.0, -12.0, 60.0]) + rng.standard_normal(TIME.size)
    values = {"P K0": pressure, "P K1": np.full(TIME.size, 9e5), "T engine": torque}
    values["T motor"] = np.full(TIME.size, 90.0)
    speeds = {
        "crank": 0.0,
        "rotor": 95.0,
        "vehicle": 90.0,
        **({"gearbox": 90.0} if shaft or tyre else {}),
    }
    inputs = {name: Signal(TIME, column) for name, column in values.items()}
    return NetworkScenario(inputs, Start(speeds, {"axle": 0.002} if shaft else {}))


def sets(runs: int) -> dict[str, FloatArray]:
    """Values spread by 5 %."""
    rng = np.random.default_rng(1)
    nominal = {"engine.inertia": 0.18, "K0.gain": 9e-4, "K0.friction.mu_c": 0.11}
    nominal |= {"K1.p0": 8e4, "start.rotor": 95.0}
    return {path: v * (1.0 + 0.05 * rng.standard_normal(runs)) for path, v in nominal.items()}


def change(elements: list[Element], start: Start, values: dict[str, float]) -> Any:
    """Return elements and start with the numbers of `sets`."""
    changed, speeds = [dict(one) for one in elements], dict(start.speeds)
    by_name = {one["name"]: one for one in changed}
    for path, value in values.items():
        head, *fields = path.split(".")
        if head == "start":
            speeds[fields[0]] = value
        elif len(fields) == 2:
            by_name[head][fields[0]] = {**by_name[head][fields[0]], fields[1]: value}
        else:
            by_name[head][fields[0]] = value
    return changed, Start(speeds, start.twists, start.locked)


OUTPUTS: list[Output] = [("speed", "crank"), ("slip", "K1"), ("friction_torque", "K0")]


@pytest.mark.parametrize(("shaft", "tyre"), [(False, False), (True, False), (False, True)])
@pytest.mark.parametrize("threads", [1, 3])
def test_runs_are_what_each_is_alone_on_any_number_of_threads(
    shaft: bool, tyre: bool, threads: int
) -> None:
    given, elements = scenario(shaft=shaft, tyre=tyre), hybrid(shaft=shaft, tyre=tyre)
    values = sets(11)
    batch = simulate_network_batch(elements, [given], TIME, OUTPUTS, values, threads=threads)
    assert not batch.failed
    for i in range(11):
        changed, start = change(elements, given.start, {k: float(v[i]) for k, v in values.items()})
        run = simulate(changed, given.inputs, start, TIME, OUTPUTS)
        assert len(run.events) == batch.events[i] > 2
        for output, column in zip(OUTPUTS, batch.values[i], strict=True):
            np.testing.assert_array_equal(column, run.columns[output])
        locks = [one.time for one in run.events if one.kind == "lock"]
        assert batch.last_lock[i] == locks[-1]


def test_scenarios_are_what_each_is_alone() -> None:
    scenarios = [scenario(shaft=False, seed=seed) for seed in range(9)]
    held = {**scenarios[3].inputs, "T motor": Sine(4.0, 3.0, offset=90.0)}
    scenarios[3] = NetworkScenario(held, scenarios[3].start)
    elements = hybrid(shaft=False)
    batch = simulate_network_batch(elements, scenarios, TIME, OUTPUTS, keep=Keep.LAST)
    for one, values in zip(scenarios, batch.values, strict=True):
        run = simulate(elements, one.inputs, one.start, TIME, OUTPUTS)
        assert values == pytest.approx([run.columns[o][-1] for o in OUTPUTS], rel=1e-12, abs=1e-9)


def test_values_that_change_what_holds_leave_the_outputs_their_names() -> None:
    elements = hybrid(shaft=False)
    elements = [elements[-1], *elements[:-1]]
    given, values = scenario(shaft=False), {"load.rolling": np.array([0.0, 15.0] * 4)}
    batch = simulate_network_batch(elements, [given], TIME, OUTPUTS, values)
    for rolling, columns in zip(values["load.rolling"], batch.values, strict=True):
        changed, start = change(elements, given.start, {"load.rolling": rolling})
        run = simulate(changed, given.inputs, start, TIME, OUTPUTS)
        np.testing.assert_array_equal(columns, [run.columns[output] for output in OUTPUTS])


@pytest.mark.parametrize("shaft", [False, True])
def test_derivatives_are_those_of_each_run_alone(shaft: bool) -> None:
    given, elements, values = scenario(shaft=shaft), hybrid(shaft=shaft), sets(3)
    unknowns = {
        **{path: {path: 1.0} for path in ("K0.friction.mu_s", "start.crank", "delay.P K0")},
        "both": {"K0.p0": 2.0, "K1.p0": -0.5},
    }
    found = differentiate_network_batch(elements, [given], TIME, OUTPUTS, unknowns, values)
    assert found.parameters == tuple(unknowns)
    for i in range(3):
        changed, start = change(elements, given.start, {k: float(v[i]) for k, v in values.items()})
        alone = differentiate(changed, given.inputs, start, TIME, OUTPUTS, unknowns)
        for output, slopes in zip(OUTPUTS, found.derivatives[i].swapaxes(0, 1), strict=True):
            expected = alone.derivatives[output].T
            np.testing.assert_allclose(slopes, expected, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("K0.friction.mu_k", "did you mean 'mu_"),
        ("rotr.inertia", "did you mean 'rotor'"),
        ("start.rotr", "did you mean 'rotor'"),
        ("delay.T motor", "cannot change from run to run"),
    ],
)
def test_paths_without_a_number_are_refused(path: str, message: str) -> None:
    given, elements = scenario(shaft=False), hybrid(shaft=False)
    with pytest.raises(InputError, match=message):
        simulate_network_batch(elements, [given], TIME, OUTPUTS, {path: np.ones(2)})


def test_derivatives_at_a_corner_are_refused() -> None:
    given, elements = scenario(shaft=False), hybrid(shaft=False)
    with pytest.raises(InputError, match="corner"):
        differentiate_network_batch(elements, [given], TIME, OUTPUTS, ["load.rolling"])
    gains = {"K0.gain": np.array([9e-4, 0.0])}
    with pytest.raises(InputError, match="corner"):
        differentiate_network_batch(elements, [given], TIME, OUTPUTS, ["K0.gain"], gains)
    with pytest.raises(InputError, match="nothing to differentiate by"):
        differentiate_network_batch(elements, [given], TIME, OUTPUTS, [])


def test_a_torque_at_the_ground_is_refused() -> None:
    brake = [*hybrid(shaft=False), clutch("brake", "vehicle", "ground", 1e-3)]
    given = scenario(shaft=False)
    inputs = {**given.inputs, "P brake": Signal(TIME, np.zeros(TIME.size))}
    with pytest.raises(InputError, match="no torque at the ground"):
        simulate_network_batch(
            brake, [NetworkScenario(inputs, given.start)], TIME, [("torque", "brake.b")]
        )
