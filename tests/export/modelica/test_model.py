# SPDX-License-Identifier: MIT
"""Whole networks as Modelica packages."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivetwin.export.modelica.inputs import make_identifier
from drivetwin.export.modelica.model import Run, format_package
from drivetwin.gearbox import build_network_elements, load_gearbox
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import Element, Start, simulate
from tests.export.modelica.compiled import run

TIME = np.linspace(0.0, 0.05, 51)


def _gearbox() -> tuple[list[Element], dict[str, Signal], str, str]:
    """A built-in planetary gearbox between an engine and a vehicle, two brakes under pressure."""
    gearbox = load_gearbox("three-set-3000")
    elements: list[Element] = [
        *build_network_elements(gearbox),
        {"type": "inertia", "name": "engine", "node": gearbox.input, "inertia": 3.0},
        {"type": "torque", "name": "engine torque", "node": gearbox.input, "input": "T_e"},
        {"type": "inertia", "name": "vehicle", "node": gearbox.output, "inertia": 60.0},
    ]
    inputs = {
        str(one["pressure"]): Signal(np.array([0.0, 1.0]), np.array([0.0, 0.0]))
        for one in elements
        if one["type"] == "clutch"
    }
    pressed = [one for one in elements if one["type"] == "clutch" and one["b"] == "ground"][:2]
    for brake in pressed:
        inputs[str(brake["pressure"])] = Signal(np.array([0.0, 1.0]), np.array([1.5e5, 3e5]))
    inputs["T_e"] = Signal(np.array([0.0, 1.0]), np.array([400.0, 600.0]))
    return elements, inputs, gearbox.input, gearbox.output


def test_a_planetary_gearbox_moves_as_in_the_core(tmp_path: Path) -> None:
    elements, inputs, shaft, output = _gearbox()
    given = Start({shaft: 200.0, output: 20.0, "R1": 300.0})
    nodes = sorted({str(one["node"]) for one in elements if one["type"] == "inertia"})
    ours = simulate(elements, inputs, given, TIME, [("speed", node) for node in nodes])
    assert ours.status == "completed"
    start = Start({node: float(ours.columns["speed", node][0]) for node in nodes})
    text = format_package("three-set", elements, Run(inputs, start, (0.0, 0.05)))
    names = {
        str(one["node"]): make_identifier(str(one["name"]))
        for one in elements
        if one["type"] == "inertia"
    }
    theirs = run(text, TIME, [f"{names[node]}.w" for node in nodes], tmp_path)
    for node in nodes:
        expected = ours.columns["speed", node]
        # The tables keep within 1e-4 of the cards' friction laws, and friction does all of it.
        allowed = 1e-4 * float(np.abs(expected - expected[0]).max())
        assert theirs[f"{names[node]}.w"] == pytest.approx(expected, abs=allowed), node


def test_brakes_are_brakes_and_planets_are_inertias() -> None:
    elements, _, _, _ = _gearbox()
    text = format_package("three-set", elements)
    brakes = [one for one in elements if one["type"] == "clutch" and one["b"] == "ground"]
    clutches = [one for one in elements if one["type"] == "clutch" and one["b"] != "ground"]
    assert text.count("Components.Brake ") == len(brakes) > 0
    assert text.count("Components.Clutch ") == len(clutches) > 0
    planet: Element = {
        **{"type": "planetary", "name": "P", "sun": "s", "ring": "r", "carrier": "c"},
        **{"z": 2.0, "planet_inertia": 0.1},
    }
    assert "IdealPlanetary P_pinions(ratio=0.5);" in format_package("one", [planet])
    assert "Inertia P_planets(J=0.1);" in format_package("one", [planet])


def test_inputs_are_sampled_at_every_moment_that_any_of_them_has() -> None:
    elements: list[Element] = [
        {"type": "inertia", "name": "J", "node": "n", "inertia": 1.0},
        {"type": "torque", "name": "T", "node": "n", "input": "a"},
        {"type": "torque", "name": "U", "node": "n", "input": "b"},
    ]
    inputs = {
        "a": Signal(np.array([0.0, 1.0]), np.array([0.0, 10.0])),
        "b": Signal(np.array([0.0, 0.25, 2.0]), np.array([1.0, 2.0, 2.0]), delay=0.25),
    }
    text = format_package("two", elements, Run(inputs, Start({"n": 3.0}), (0.25, 1.0)))
    assert "table=[0.25, 2.5, 1.0;\n      0.5, 5.0, 2.0;\n      1.0, 10.0, 2.0]" in text
    assert "driveline.u_b = inputs.y[2];" in text
    assert "StartTime=0.25, StopTime=1.0" in text
