# SPDX-License-Identifier: MIT
"""Gearboxes with more elements applied than hold a gear: limit load, any pressures."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.optimize import linprog

from drivetwin.gearbox import (
    Gearbox,
    build_network_elements,
    list_builtin_gearboxes,
    load_gearbox,
    reduce,
)
from drivetwin.gearbox.compare import build_whole_gearbox
from drivetwin.gearbox.maneuver import plan
from drivetwin.simulation.dual_clutch import Accuracy, Signal
from drivetwin.simulation.network import Element, NetworkRun, Output, Start, simulate
from tests.support.arrays import FloatArray
from tests.support.repeats import mark_repeats

BOXES = [name for name in list_builtin_gearboxes() if not load_gearbox(name).dogs]
SECOND = np.array([0.0, 1.0])
RIGID_PLASTIC = {
    "friction": {"slip": [0.0], "mu": [1.0]},
    "gain": 1.0,
    "p0": 0.0,
    "peak": 1.0,
}


def elements_of(box: Gearbox) -> list[Element]:
    """The gearbox with capacities equal to its pressures, and a torque on either shaft."""
    plain = [
        {**each, **RIGID_PLASTIC} if each["type"] == "clutch" else each
        for each in build_network_elements(box)
    ]
    shafts = {"input": box.input, "output": box.output}
    torques = [
        {"type": "torque", "name": f"T {name}", "node": node, "input": f"T {name}"}
        for name, node in shafts.items()
    ]
    return [*plain, *torques]


def limit_load(box: Gearbox, capacities: dict[str, float], drive: float, way: float) -> float:
    """The largest torque on the output, in direction `way`, that torques within bounds balance.

    The lower-bound theorem of plastic limit analysis; independent of how the torques are split.
    """
    elements = build_network_elements(box)
    ends = ("a", "b", "sun", "ring", "carrier", "node")
    nodes = sorted({each[end] for each in elements for end in ends if end in each} - {"ground"})
    unit = dict(zip(nodes, np.eye(len(nodes)), strict=True)) | {"ground": np.zeros(len(nodes))}
    rigid = [
        unit[each["sun"]]
        + each["z"] * unit[each["ring"]]
        - (1.0 + each["z"]) * unit[each["carrier"]]
        for each in elements
        if each["type"] == "planetary"
    ]
    rigid += [
        unit[each["a"]] - each["ratio"] * unit[each["b"]]
        for each in elements
        if each["type"] == "gear"
    ]
    free = null_space(np.array(rigid)).T
    clutches = [each for each in elements if each["type"] == "clutch"]
    slips = np.array([unit[each["a"]] - unit[each["b"]] for each in clutches])
    within = [(-capacities[each["name"]], capacities[each["name"]]) for each in clutches]
    found = linprog(
        [*np.zeros(len(clutches)), -1.0],
        A_eq=np.column_stack([free @ slips.T, free @ (way * unit[box.output])]),
        b_eq=-free @ (drive * unit[box.input]),
        bounds=[*within, (None, None)],
    )
    assert found.x is not None, found.message
    return float(found.x[-1])


def speeds(nodes: list[str]) -> list[Output]:
    return [("speed", node) for node in nodes]


def loaded(box: Gearbox, capacities: dict[str, float], drive: float, load: float) -> NetworkRun:
    """All applied at standstill: a constant torque on the input, a rising one on the output."""
    elements = elements_of(box)
    nodes = [each["node"] for each in elements if each["type"] == "inertia"]
    inputs = {name: Signal(SECOND, np.full(2, value)) for name, value in capacities.items()}
    inputs["T input"] = Signal(SECOND, np.full(2, drive))
    inputs["T output"] = Signal(SECOND, np.array([0.0, load]))
    start = Start(speeds=dict.fromkeys(nodes, 0.0), twists={}, locked=tuple(capacities))
    return simulate(elements, inputs, start, np.linspace(0.0, 1.0, 101), speeds(nodes))


@pytest.mark.parametrize("seed", mark_repeats(range(40), range(3)))
@pytest.mark.parametrize("name", BOXES)
def test_a_tied_up_gearbox_holds_up_to_its_limit_load(name: str, seed: int) -> None:
    rng = np.random.default_rng(seed)
    box = load_gearbox(name)
    elements = elements_of(box)
    clutches = [each["name"] for each in elements if each["type"] == "clutch"]
    capacities = dict(zip(clutches, 10.0 ** rng.uniform(0.5, 3.0, len(clutches)), strict=True))
    drive, way = float(rng.uniform(-1.0, 1.0)), float(rng.choice([-1.0, 1.0]))
    limit = limit_load(box, capacities, drive, way)
    run = loaded(box, capacities, drive, 2.0 * way * limit)
    assert run.status == "completed"
    first = next(event.time for event in run.events if event.kind == "break_away")
    assert first == pytest.approx(0.5, abs=1e-6)
    moved = np.array(list(run.columns.values()))
    assert np.abs(moved[:, run.time <= 0.5]).max() < 1e-9
    assert np.abs(moved[:, -1]).max() > 1.0


@pytest.mark.parametrize("name", BOXES)
def test_round_numbers_that_make_torques_meet_their_bounds_together_do_no_harm(name: str) -> None:
    rng, box = np.random.default_rng(2), load_gearbox(name)
    clutches = [each["name"] for each in elements_of(box) if each["type"] == "clutch"]
    for case in range(15):
        levels = rng.choice([5.0, 10.0, 20.0, 200.0], len(clutches))
        capacities = dict(zip(clutches, map(float, levels), strict=True))
        way = float(rng.choice([-1.0, 1.0]))
        run = loaded(box, capacities, 0.0, 2.0 * way * limit_load(box, capacities, 0.0, way))
        assert run.status == "completed", f"case {case}"
        first = next(event.time for event in run.events if event.kind == "break_away")
        assert first == pytest.approx(0.5, abs=1e-6), f"case {case}"


def under_any_pressures(name: str, rng: np.random.Generator) -> Any:
    """A shift from its start on, with torque and pressures that have nothing to do with it."""
    box = load_gearbox(name)
    assert box.drive is not None
    shift = reduce(box, box.gears[1].name, box.gears[2].name)
    stated = build_whole_gearbox(shift, plan(shift, box.drive))
    pressures = [name for name in sorted(stated.inputs) if name != "engine torque"]
    high = max(float(stated.inputs[name].values.max()) for name in pressures)
    torque = float(np.abs(stated.inputs["engine torque"].values).max())
    time = np.linspace(0.0, 1.0, 6)

    def line(values: FloatArray) -> Signal:
        return Signal(time, values)

    inputs = {each: line(rng.choice([0.0, 1.0, rng.uniform()], 6) * high) for each in pressures}
    inputs["engine torque"] = line(rng.uniform(-1.0, 1.5, 6) * torque)
    return replace(stated, inputs=inputs)


@pytest.mark.parametrize("name", mark_repeats(BOXES, ("ravigneaux-4",)))
def test_a_gearbox_runs_through_any_pressures(name: str) -> None:
    rng, time = np.random.default_rng(1), np.linspace(0.0, 1.0, 1001)
    for case in range(60):
        stated = under_any_pressures(name, rng)
        nodes = speeds(list(stated.start.speeds))
        given = (stated.elements, stated.inputs, stated.start, time, nodes)
        run, exact = simulate(*given), simulate(*given, accuracy=Accuracy(exact=True))
        assert (run.status, exact.status) == ("completed", "completed"), f"case {case}"
        by_operators, by_series = (np.array(list(each.columns.values())) for each in (run, exact))
        assert np.abs(by_operators - by_series).max() < 5e-3 * np.abs(by_series).max()
