# SPDX-License-Identifier: MIT
"""Energy closes from the recorded columns alone; torques at a node vanish in sum."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.element_schema import GROUND, list_ports
from drivetwin.simulation.network import Element, NetworkRun, Output, Start, build_element, simulate
from tests.support.arrays import FloatArray
from tests.support.random_network import SECONDS, draw_network

GRID: FloatArray = np.linspace(0.0, SECONDS, 101)
BALANCE = 1e-8
"""Largest error of an energy balance, relative to the largest energy of the run."""
OPEN = ("torque", "engine_map", "prescribed_speed", "road_load")
"""Elements that exchange energy with the surroundings."""


def _list_outputs(elements: Sequence[Element]) -> list[Output]:
    outputs: list[Output] = []
    for element in elements:
        name = str(element["name"])
        outputs += [("work", name), ("heat", name), ("energy", name), ("power", name)]
        ports = list_ports(element)
        outputs += [("torque", f"{name}.{port}") for port, node in ports.items() if node != GROUND]
        outputs += [("speed", node) for node in ports.values() if node != GROUND]
    return list(dict.fromkeys(outputs))


def _check(elements: Sequence[Element], done: NetworkRun, label: str = "") -> None:
    """Compare works, heats and stored energies of all elements on every sample."""
    columns = done.columns
    names = [str(element["name"]) for element in elements]
    size = max(
        float(np.abs(columns[kind, name]).max())
        for name in names
        for kind in ("work", "heat", "energy")
    )
    for element in elements:
        name = str(element["name"])
        if element["type"] not in OPEN:
            stored = columns["energy", name] - columns["energy", name][0]
            gap = columns["work", name] - columns["heat", name] - stored
            assert np.abs(gap).max() <= BALANCE * size, (label, name)
        power = np.zeros_like(done.time)
        for port, node in list_ports(element).items():
            if node != GROUND:
                power -= columns["torque", f"{name}.{port}"] * columns["speed", node]
        assert columns["power", name] == pytest.approx(power, abs=1e-12 * np.abs(power).max())
    total = np.sum([columns["work", name] for name in names], axis=0)
    assert np.abs(total).max() <= BALANCE * size, label
    _check_nodes(elements, done)


def _check_nodes(elements: Sequence[Element], done: NetworkRun) -> None:
    sums: dict[str, list[FloatArray]] = {}
    for element in elements:
        for port, node in list_ports(element).items():
            if node != GROUND:
                column = done.columns["torque", f"{element['name']}.{port}"]
                sums.setdefault(node, []).append(column)
    for node, torques in sums.items():
        largest = max(float(np.abs(torque).max()) for torque in torques)
        assert np.abs(np.sum(torques, axis=0)).max() <= 1e-9 * largest, node


def _inertia(node: str, inertia: float) -> Element:
    return build_element("inertia", f"J {node}", node=node, inertia=inertia)


def _drive() -> list[Element]:
    """Engine, converter, planetary set with brake, lossy gear, shaft, backlash, tyre, road."""
    converter = {
        "speed_ratio": [0.0, 0.85, 1.0, 1.3],
        "capacity": [0.036, 0.02, 0.0, -0.012],
        "torque_ratio": [1.9, 1.0, 1.0, 1.0],
    }
    law = {"friction": {"mu_c": 0.1, "mu_s": 0.12, "v_s": 5.0, "mu_v": 0.0}, "gain": 0.02}
    loss = {"law": "dissipative", "eta": 0.95, "eta_backward": 0.9, "drag": 2.0}
    return [
        *(_inertia(node, value) for node, value in (("e", 0.3), ("t", 0.1), ("o", 0.2))),
        *(_inertia(node, value) for node, value in (("r", 0.05), ("w", 2.0), ("v", 90.0))),
        build_element("torque", "engine", node="e", input="T"),
        build_element("torque_converter", "TC", pump="e", turbine="t", map=converter),
        build_element(
            "planetary", "P", sun="t", ring="r", carrier="o", z=2.0, planet_inertia=0.001
        ),
        build_element(
            "clutch",
            "B",
            a="r",
            b="ground",
            **law,
            p0=0.0,
            peak=1.1,
            pressure="P",
            drum_inertia=0.01,
        ),
        build_element("spring_damper", "shaft", a="o", b="s", stiffness=9e3, damping=20.0),
        build_element("gear", "final", a="s", b="x", ratio=3.0, loss=loss),
        _inertia("x", 0.4),
        build_element("backlash", "spline", a="x", b="w", stiffness=2e4, damping=30.0, gap=0.02),
        build_element("tyre", "tyre", a="w", b="v", slip_stiffness=4e4, least_speed=0.5),
        build_element("road_load", "road", node="v", constant=20.0, rolling=30.0, aero=0.4),
        build_element(
            "bearing", "bearing", a="v", b="ground", speed=[0.0, 50.0], torque=[1.0, 3.0], peak=1.0
        ),
    ]


def test_a_whole_drive_closes_from_its_columns() -> None:
    elements = _drive()
    inputs = {
        "T": Signal(np.array([0.0, 1.0, 1.4, 2.0]), np.array([150.0, 200.0, -60.0, -60.0])),
        "P": Signal(np.array([0.0, 0.3, 2.0]), np.array([0.0, 4e5, 4e5])),
    }
    start = Start({"e": 120.0, "t": 90.0, "r": 0.0, "x": 8.0, "w": 8.0, "v": 8.0})
    time = np.linspace(0.0, 2.0, 401)
    done = simulate(elements, inputs, start, time, _list_outputs(elements), audit=True)
    assert done.status == "completed"
    assert "lock" in [event.kind for event in done.events if event.element == "B"]
    _check(elements, done)
    assert done.audit is not None
    heat = sum(done.columns["heat", name][-1] for name in ("TC", "tyre"))
    assert heat == pytest.approx(done.audit.converter, rel=1e-9)
    source = -done.columns["work", "engine"][-1]
    assert source == pytest.approx(done.audit.source, rel=1e-9)


def test_random_networks_close_from_their_columns() -> None:
    """Energies after the starting impulse: that is an event before the first sample."""
    closed = 0
    for seed in range(20):
        network = draw_network(seed)
        inputs = {name: Signal(*samples) for name, samples in network.inputs.items()}
        start = Start(network.speeds, locked=network.locked)
        outputs = _list_outputs(network.elements)
        try:
            done = simulate(network.elements, inputs, start, GRID, outputs)
        except InputError:
            continue
        if done.status == "completed":
            closed += 1
            _check(network.elements, done, f"seed {seed}")
    assert closed > 12


def test_accelerations_are_the_rates_of_speeds() -> None:
    """Also of a member without mass, whose speed follows from a damper's torque."""
    elements = [
        _inertia("a", 1.0),
        _inertia("c", 2.0),
        build_element("spring_damper", "s1", a="a", b="b", stiffness=400.0, damping=3.0),
        build_element("spring_damper", "s2", a="b", b="c", stiffness=900.0, damping=1.0),
        build_element("torque", "T", node="b", input="T"),
    ]
    inputs = {"T": Signal(np.array([0.0, 1.0]), np.array([0.0, 30.0]))}
    start = Start({"a": 5.0, "c": 0.0})
    time = np.linspace(0.0, 1.0, 20001)
    nodes = ("a", "b", "c")
    outputs: list[Output] = [*(("speed", n) for n in nodes), *(("acceleration", n) for n in nodes)]
    done = simulate(elements, inputs, start, time, outputs)
    for node in nodes:
        measured = np.gradient(done.columns["speed", node], time)[1:-1]
        stated = done.columns["acceleration", node][1:-1]
        assert stated == pytest.approx(measured, abs=1e-4 * np.abs(measured).max()), node
