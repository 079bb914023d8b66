# SPDX-License-Identifier: MIT
"""Runs with sines, without inputs, and with elements that need helper models."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.export.modelica.model import Run, format_package
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import Element, Sine, Start, build_element, simulate
from tests.export.modelica.compiled import run

TIME = np.linspace(0.0, 0.5, 251)


def _inertia(node: str, inertia: float) -> Element:
    return build_element("inertia", f"J {node}", node=node, inertia=inertia)


def _compare(
    elements: list[Element],
    inputs: dict[str, Signal | Sine],
    start: Start,
    folder: Path,
) -> str:
    """Compare all speeds with those of the core; return the text of the package."""
    nodes = [str(one["node"]) for one in elements if one["type"] == "inertia"]
    ours = simulate(elements, inputs, start, TIME, [("speed", node) for node in nodes])
    assert ours.status == "completed"
    text = format_package("net", elements, Run(inputs, start, (0.0, float(TIME[-1]))))
    theirs = run(text, TIME, [f"J_{node}.w" for node in nodes], folder)
    for node in nodes:
        expected = ours.columns["speed", node]
        allowed = 1e-6 * float(np.abs(expected).max())
        assert theirs[f"J_{node}.w"] == pytest.approx(expected, abs=allowed), node
    return text


def test_a_sine_is_an_equation_beside_a_table_of_samples(tmp_path: Path) -> None:
    elements = [
        _inertia("a", 0.5),
        build_element("torque", "T", node="a", input="wave"),
        build_element("torque", "U", node="a", input="samples"),
    ]
    inputs: dict[str, Signal | Sine] = {
        "wave": Sine(-20.0, 3.0, phase=-0.4, offset=5.0),
        "samples": Signal(np.array([0.0, 0.5]), np.array([1.0, 4.0])),
    }
    text = _compare(elements, inputs, Start({"a": 1.0}), tmp_path)
    assert "timeEvents=Modelica.Blocks.Types.TimeEvents.AtDiscontinuities" in text
    assert "driveline.u_samples = inputs.y[1];" in text


def test_a_converter_starts_with_its_pump_at_rest(tmp_path: Path) -> None:
    table = {
        "speed_ratio": [0.0, 0.85, 1.0, 1.3],
        "capacity": [0.036, 0.02, 0.0, -0.012],
        "torque_ratio": [1.9, 1.0, 1.0, 1.0],
    }
    elements = [
        _inertia("pump", 0.3),
        _inertia("turbine", 0.2),
        build_element("torque_converter", "TC", pump="pump", turbine="turbine", map=table),
        build_element("torque", "T", node="pump", input="T"),
    ]
    inputs: dict[str, Signal | Sine] = {"T": Sine(50.0, 0.5, phase=0.5, offset=50.0)}
    _compare(elements, inputs, Start({"pump": 0.0, "turbine": 20.0}), tmp_path)


def test_a_tyre_and_a_progressive_shaft_move_as_in_the_core(tmp_path: Path) -> None:
    table = {"twist": [-0.02, -0.01, 0.0, 0.01, 0.03], "torque": [-900.0, -300.0, 0.0, 400.0, 2e3]}
    elements = [
        _inertia("engine", 1.0),
        _inertia("wheel", 3.0),
        _inertia("vehicle", 200.0),
        build_element("spring_table", "shaft", a="engine", b="wheel", damping=20.0, **table),
        build_element("tyre", "tyre", a="wheel", b="vehicle", slip_stiffness=4e4, least_speed=2.0),
        build_element("torque", "T", node="engine", input="T"),
    ]
    inputs: dict[str, Signal | Sine] = {"T": Sine(900.0, 2.0)}
    start = Start({"engine": 9.0, "wheel": 9.0, "vehicle": 8.0}, {"shaft": 0.004})
    _compare(elements, inputs, start, tmp_path)


def test_a_viscous_coupling_moves_as_in_the_core_in_either_sense(tmp_path: Path) -> None:
    table = {"slip": [4.0, 10.0], "torque": [12.0, 15.0]}
    elements = [
        _inertia("a", 0.5),
        _inertia("b", 0.8),
        build_element("viscous_coupling", "coupling", a="a", b="b", **table),
        build_element("torque", "T", node="a", input="T"),
    ]
    inputs: dict[str, Signal | Sine] = {"T": Sine(60.0, 1.0)}
    text = _compare(elements, inputs, Start({"a": 20.0, "b": 0.0}), tmp_path)
    assert "ViscousCoupling coupling(characteristic=[-10.0, -15.0;" in text


def test_an_input_that_the_run_lacks_is_named() -> None:
    source = build_element("torque", "T", node="a", input="T_e")
    with pytest.raises(InputError, match="no input 'T_e'"):
        format_package("net", [_inertia("a", 1.0), source], Run({}, Start({"a": 0.0}), (0.0, 1.0)))
