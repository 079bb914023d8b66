# SPDX-License-Identifier: MIT
"""Contract of elements: each type that the core registers passes the same checks.

The example of a type is that of its section in `docs/reference/elements.md`.
"""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivetwin.errors import DrivetwinError, InputError
from drivetwin.modeling.model import Model
from drivetwin.modeling.model_components import Plates
from drivetwin.simulation.dual_clutch import Accuracy, Signal, Stribeck
from drivetwin.simulation.element_schema import ELEMENT_FIELDS, list_ports
from drivetwin.simulation.network import NetworkRun, Output, Start, simulate
from drivetwin.simulation.network_sensitivity import differentiate

PAGE = (Path(__file__).resolve().parents[2] / "docs" / "reference" / "elements.md").read_text(
    encoding="utf-8"
)
TIME = np.linspace(0.0, 0.2, 21)
INPUTS = {"P B2": 2e5, "P F1": 1e5, "T_e": 30.0, "pedal": 0.5, "wheel speed": 20.0}
COUPLED = {"gear": ("b",), "planetary": ("sun", "ring"), "prescribed_speed": ()}
"""Ports whose speeds determine those of the others; by default all."""
OPEN = ("torque", "engine_map", "prescribed_speed", "road_load")
"""Types that exchange energy with the surroundings."""
WITHOUT_DERIVATIVES = ("torque_converter", "prescribed_speed", "torque")
"""Types of which no number has a derivative: they are refused by name, or have no number."""
NAMES = ("type", "name", "input", "pressure", "throttle")


def read_example(kind: str) -> dict[str, Any]:
    section = PAGE.split(f"\n## {kind}\n")[1]
    element: dict[str, Any] = json.loads(section.split("```json\n")[1].split("```")[0])
    return element


def list_nodes(element: Mapping[str, Any]) -> list[str]:
    return [node for node in dict.fromkeys(list_ports(element).values()) if node != "ground"]


def build_start(element: Mapping[str, Any]) -> dict[str, float]:
    """Speeds that differ by 4 rad/s from node to node."""
    ports = list_ports(element)
    given = {ports[one] for one in COUPLED.get(str(element["type"]), ports)}
    return {node: 20.0 + 4.0 * k for k, node in enumerate(list_nodes(element)) if node in given}


def run(element: Mapping[str, Any]) -> NetworkRun:
    """Simulate the element between inertias, audited; the inputs are constant."""
    return simulate(*describe(element), list_outputs(element), audit=True, accuracy=EXACT)


EXACT = Accuracy(exact=True)


def describe(element: Mapping[str, Any]) -> tuple[Any, Any, Start, Any]:
    masses = [
        {"type": "inertia", "name": f"mass of {node}", "node": node, "inertia": 1.0}
        for node in list_nodes(element)
    ]
    ends = np.array([0.0, 1.0])
    inputs = {name: Signal(ends, np.full(2, value)) for name, value in INPUTS.items()}
    return [element, *masses], inputs, Start(build_start(element)), TIME


def list_outputs(element: Mapping[str, Any]) -> list[Output]:
    name = str(element["name"])
    speeds: list[Output] = [("speed", node) for node in list_nodes(element)]
    return [*speeds, ("work", name), ("heat", name), ("energy", name)]


def build_model(element: Mapping[str, Any]) -> Model:
    """The same network by the methods of `Model`."""
    model = Model("contract")
    for node in list_nodes(element):
        model.inertia(f"mass of {node}", 1.0, node)
    fields = {key: value for key, value in element.items() if key not in ("type", "name")}
    ports = list_ports(element)
    for port, node in ports.items():
        fields[port] = model.ground if node == "ground" else node
    for key, value in fields.items():
        if key in ("input", "pressure", "throttle"):
            fields[key] = INPUTS[value]
    if "node" in fields:
        fields["at"] = fields.pop("node")
    if "input" in fields:
        fields["value"] = fields.pop("input")
    if element["type"] == "clutch":
        law = Stribeck(**fields.pop("friction"))
        kept = {key: fields.pop(key) for key in [*fields] if key in Plates.__dataclass_fields__}
        fields["plates"] = Plates(friction=law, **kept)
    if element["type"] == "one_way_clutch":
        fields["clutch"] = {**fields["clutch"], "pressure": INPUTS["P F1"]}
    getattr(model, str(element["type"]))(element["name"], **fields)
    speeds: dict[Any, float] = {**build_start(element)}
    model.start(speeds)
    return model


def iterate_numbers(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Yield the places of the numbers other than zero."""
    items = value.items() if isinstance(value, dict) else enumerate(value)
    for key, one in items:
        if isinstance(one, dict | list):
            yield from iterate_numbers(one, (*path, key))
        elif isinstance(one, float) and one:
            yield (*path, key)


def change(element: Mapping[str, Any], path: tuple[Any, ...], factor: float) -> dict[str, Any]:
    changed: Any = copy.deepcopy(dict(element))
    place = changed
    for key in path[:-1]:
        place = place[key]
    place[path[-1]] *= factor
    return dict(changed)


@pytest.mark.parametrize("kind", ELEMENT_FIELDS)
def test_a_run_completes_and_its_energy_closes(kind: str) -> None:
    element = read_example(kind)
    done = run(json.loads(json.dumps(element)))
    assert done.status == "completed"
    assert done.audit is not None
    work, heat, energy = (done.columns[one, element["name"]] for one in ("work", "heat", "energy"))
    size = max(1.0, *(float(np.abs(one).max()) for one in (work, heat, energy)))
    assert abs(done.audit.error) < 1e-8 * max(size, abs(done.audit.stored))
    if kind not in OPEN:
        assert np.abs(work - heat - (energy - energy[0])).max() < 1e-8 * size


@pytest.mark.parametrize("kind", ELEMENT_FIELDS)
def test_a_model_moves_as_its_description(kind: str) -> None:
    element = read_example(kind)
    expected, model = run(element), build_model(element)
    outputs = [one for one in list_outputs(element) if one[0] == "speed"]
    found = model.simulate(TIME, record=outputs, accuracy=EXACT)
    for output in outputs:
        assert found[output] == pytest.approx(expected.columns[output], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("kind", ELEMENT_FIELDS)
def test_derivatives_are_those_of_differences_or_refused_by_name(kind: str) -> None:
    element, step = read_example(kind), 1e-5
    speeds = [one for one in list_outputs(element) if one[0] == "speed"]
    refusals: list[str] = []
    paths = list(iterate_numbers({k: v for k, v in element.items() if k not in NAMES}))
    for path in paths:
        unknown = ".".join(map(str, (element["name"], *path)))
        try:
            found = differentiate(*describe(element), speeds, [unknown], accuracy=EXACT)
            up, down = (run(change(element, path, 1.0 + sign * step)) for sign in (1.0, -1.0))
        except InputError as fault:
            refusals.append(str(fault))
            continue
        value: Any = element
        for key in path:
            value = value[key]
        for output in speeds:
            expected = (up.columns[output] - down.columns[output]) / (2.0 * step * value)
            near = 1e-3 * np.abs(expected).max() + 1e-6 / abs(value)
            assert found.derivatives[output][:, 0] == pytest.approx(expected, abs=near), unknown
    assert all(str(element["name"]) in one for one in refusals)
    assert (len(refusals) < len(paths)) is (kind not in WITHOUT_DERIVATIVES)


@pytest.mark.parametrize("kind", ELEMENT_FIELDS)
def test_an_element_is_drawn_and_exported_or_refused_by_name(kind: str) -> None:
    element, model = read_example(kind), build_model(read_example(kind))
    assert element["name"] in model.draw()
    try:
        text = model.to_modelica(0.1)
    except DrivetwinError as refusal:
        text = str(refusal)
    assert element["name"].replace(" ", "_") in text.replace(" ", "_")
