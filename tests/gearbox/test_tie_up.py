# SPDX-License-Identifier: MIT
"""All elements of a gearbox applied at standstill: it holds up to the limit load of plasticity."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.optimize import linprog

from drivetwin.driveline import Signal
from drivetwin.gearbox import Gearbox, builtin_gearboxes, load_gearbox
from drivetwin.gearbox.network import network_elements
from drivetwin.network import NetworkRun, Start, simulate

BOXES = [name for name in builtin_gearboxes() if not load_gearbox(name).dogs]
SECOND = np.array([0.0, 1.0])
RIGID_PLASTIC = {
    "friction": {"slip": [0.0], "mu": [1.0]},
    "gain": 1.0,
    "p0": 0.0,
    "peak": 1.0,
}


def elements_of(box: Gearbox) -> list[dict[str, Any]]:
    """The gearbox with capacities equal to its pressures, and a torque on either shaft."""
    plain = [
        {**each, **RIGID_PLASTIC} if each["type"] == "clutch" else each
        for each in network_elements(box)
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
    elements = network_elements(box)
    nodes = sorted(
        {each[end] for each in elements for end in ("a", "b", "sun", "ring", "carrier", "node") if end in each}
        - {"ground"}
    )
    unit = {node: row for node, row in zip(nodes, np.eye(len(nodes)), strict=True)}
    unit["ground"] = np.zeros(len(nodes))
    constraints = []
    for each in elements:
        if each["type"] == "planetary":
            z = each["z"]
            constraints.append(
                unit[each["sun"]] + z * unit[each["ring"]] - (1.0 + z) * unit[each["carrier"]]
            )
        elif each["type"] == "gear":
            constraints.append(unit[each["a"]] - each["ratio"] * unit[each["b"]])
    free = null_space(np.array(constraints))
    slips = np.array(
        [unit[e["a"]] - unit[e["b"]] for e in elements if e["type"] == "clutch"]
    )
    bounds = [(-capacities[e["name"]], capacities[e["name"]]) for e in elements if e["type"] == "clutch"]
    matrix = np.column_stack([free.T @ slips.T, free.T @ (way * unit[box.output])])
    found = linprog(
        [*np.zeros(len(slips)), -1.0],
        A_eq=matrix,
        b_eq=-free.T @ (drive * unit[box.input]),
        bounds=[*bounds, (None, None)],
    )
    return float(found.x[-1]) if found.status == 0 else float("nan")


def loaded(box: Gearbox, capacities: dict[str, float], drive: float, load: float) -> NetworkRun:
    """From standstill, everything applied: a constant torque on the input, a rising one on the output."""
    elements = elements_of(box)
    nodes = [each["node"] for each in elements if each["type"] == "inertia"]
    inputs = {name: Signal(SECOND, np.full(2, value)) for name, value in capacities.items()}
    inputs["T input"] = Signal(SECOND, np.full(2, drive))
    inputs["T output"] = Signal(SECOND, np.array([0.0, load]))
    start = Start(speeds=dict.fromkeys(nodes, 0.0), twists={}, locked=tuple(capacities))
    outputs = [("speed", node) for node in nodes]
    return simulate(elements, inputs, start, np.linspace(0.0, 1.0, 101), outputs)


@pytest.mark.parametrize("seed", range(40))
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
    speeds = np.array(list(run.columns.values()))
    assert np.abs(speeds[:, run.time <= 0.5]).max() < 1e-9
    assert np.abs(speeds[:, -1]).max() > 1.0
