# SPDX-License-Identifier: MIT
"""The builder: places, inputs, quantities, events, faults, exports."""

from __future__ import annotations

import inspect
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivetwin.channels.units import RPM
from drivetwin.errors import InputError
from drivetwin.modeling.model import Model
from drivetwin.modeling.model_components import Plates
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.element_schema import ELEMENT_FIELDS
from drivetwin.simulation.network import Sine

PAGE = Path(__file__).resolve().parents[2] / "docs" / "howto" / "build-a-model.md"


def _brake_test() -> tuple[Model, Any, Any]:
    model = Model("brake test")
    wheel = model.inertia("wheel", 2.0)
    brake = model.clutch("brake", wheel, model.ground, pressure=[(0.0, 0.0), (0.0, 10.0)])
    model.start({wheel: 4.0})
    return model, wheel, brake


def test_a_brake_stops_a_wheel_and_heats_by_its_energy() -> None:
    model, wheel, brake = _brake_test()
    run = model.simulate(1.0)
    assert run.status == "completed"
    assert [event.kind for event in run.events.select(brake)] == ["lock"]
    assert run[wheel.speed] == pytest.approx(np.maximum(4.0 - 5.0 * run.time, 0.0), abs=1e-9)
    slips = run.time < 0.799
    assert run[brake.torque][slips] == pytest.approx(10.0)
    assert run[brake.power][slips] == pytest.approx(10.0 * run[wheel.speed][slips])
    assert run[brake.heat][-1] == pytest.approx(16.0, rel=1e-9)
    assert run[wheel.energy][0] == pytest.approx(16.0)
    assert run[wheel.acceleration][slips] == pytest.approx(-5.0)


def test_derivatives_are_exact_through_the_stop_of_a_wheel() -> None:
    """ω = ω0 - M·t/J up to the stop at J·ω0/M = 0.8 s, and 0 after it."""
    model, wheel, _ = _brake_test()
    found = model.differentiate(1.0, ["wheel.inertia", "start.wheel"])
    time, slopes = found.run.time, found.derivatives[wheel.speed]
    slips = time < 0.799
    assert slopes[slips] == pytest.approx(
        np.column_stack([10.0 * time / 2.0**2, np.ones(time.size)])[slips], abs=1e-9
    )
    assert np.all(slopes[time > 0.801] == 0.0)
    with pytest.raises(InputError, match="did you mean 'wheel'"):
        model.differentiate(1.0, ["weel.inertia"])


def test_the_page_runs_in_35_lines_and_its_energy_closes() -> None:
    (text,) = re.findall(
        r"^```python\n(.*?)^```", PAGE.read_text("utf-8"), re.MULTILINE | re.DOTALL
    )
    assert len(text.strip().splitlines()) <= 35
    names: dict[str, Any] = {}
    exec(text, names)
    run, truck = names["run"], names["truck"]
    assert run.status == "completed"
    kinds = [(event.element, event.kind) for event in run.events]
    assert ("lock-up", "lock") in kinds
    assert ("C3", "lock") in kinds
    balance = run.balance_energy()
    size = max(abs(one.work) for one in balance.values())
    assert abs(sum(one.work for one in balance.values())) < 1e-8 * size
    outside = ("engine", "road")
    for name, one in balance.items():
        if name not in outside:
            assert abs(one.work - one.heat - one.stored) < 1e-8 * size, name
    assert "TyreSlip tyres" in truck.to_modelica(4.0)


def test_places_are_nodes_ports_elements_and_names() -> None:
    model = Model("places")
    engine = model.inertia("engine", 0.2)
    gear = model.gear("gear", engine, ratio=2.0)
    shaft = model.spring_damper("shaft", gear.b, "wheel", stiffness=1e3)
    wheel = model.inertia("load", 1.0, "wheel")
    assert gear.a.node is engine.node.node
    assert gear.b.node.name == "gear.b"
    assert shaft.b.node is wheel.node.node is model.node("wheel")
    with pytest.raises(AttributeError, match=r"no port 'c'; known here: a, b"):
        _ = gear.c
    with pytest.raises(InputError, match=r"gear\.torque|a torque at each port"):
        _ = gear.torque


def test_inputs_are_numbers_points_samples_and_sines() -> None:
    values: list[Any] = [
        3.0,
        [(0.0, 3.0), (0.5, 3.0)],
        np.array([[0.0, 3.0], [2.0, 3.0]]),
        Signal(np.array([0.0, 1.0]), np.array([3.0, 3.0])),
        Sine(0.0, 1.0, offset=3.0),
    ]
    for value in values:
        model = Model("inputs")
        body = model.inertia("body", 2.0)
        model.torque("source", body, value)
        model.start({body: 60 * RPM})
        run = model.simulate(1.0, record=[body.speed])
        assert run[body.speed][-1] == pytest.approx(60 * RPM + 1.5, rel=1e-9)
        with pytest.raises(InputError, match=r"'acceleration body' is not recorded"):
            _ = run[body.acceleration]


def test_all_faults_are_reported_together_with_suggestions() -> None:
    model = Model("faults")
    wheel = model.inertia("wheel", "heavy")  # type: ignore[arg-type]
    gear = model.gear("gear", wheel, "axle", ratio=2.0, loss={"law": "paper", "etta": 0.9})
    model.inertia("wheel", 1.0, gear)
    model.start({"axel": 3.0}, locked=["brake"])
    with pytest.raises(InputError) as caught:
        model.simulate(1.0)
    text = str(caught.value)
    for part in (
        "wheel: inertia = 'heavy' is no finite number",
        "gear: loss: unknown field 'etta'; did you mean 'eta'?",
        "gear: loss: missing field 'eta'",
        "gear has several ports: name one of a, b",
        "wheel: two elements have this name",
        "start: no node 'axel'; did you mean 'axle'?",
        "start: no element 'brake'",
    ):
        assert part in text, part
    assert "expected one of" not in text


def test_signatures_and_help_of_the_methods_come_from_the_core() -> None:
    signature = inspect.signature(Model.spring_damper).parameters
    assert list(signature) == ["self", "name", "a", "b", "stiffness", "damping"]
    assert signature["damping"].default == 0.0
    text = inspect.getdoc(Model.spring_damper) or ""
    assert "damping : float, N·m·s/rad, ≥ 0, default 0.0\n    Damping." in text
    assert "twist' = ω_a - ω_b" in text
    assert set(ELEMENT_FIELDS) <= set(dir(Model))


def test_plates_have_the_defaults_of_a_clutch() -> None:
    fields = ELEMENT_FIELDS["clutch"]
    for name in ("gain", "p0", "peak", "drum_inertia"):
        assert getattr(Plates(), name) == fields[name].default


def test_a_one_way_clutch_takes_a_parallel_clutch_and_a_converter_its_fields() -> None:
    model = Model("parallel")
    engine, load = model.inertia("engine", 1.0), model.inertia("load", 1.0)
    parallel = {"friction": {"slip": [0.0], "mu": [0.1]}, "gain": 1.0, "p0": 0.0, "peak": 1.0}
    free = model.one_way_clutch("F", load, engine, clutch={**parallel, "pressure": 50.0})
    fields = {"speed_ratio": [0.0, 1.0], "capacity": [0.1, 0.0], "torque_ratio": [2.0, 1.0]}
    model.torque_converter("converter", engine, load, map=fields)
    model.start({engine: 10.0, load: 0.0})
    run = model.simulate(0.1, record=[free.torque])
    assert run.status == "completed"
    assert run[free.torque][1] == pytest.approx(-5.0)


def test_a_schematic_names_nodes_and_elements() -> None:
    model, _, _ = _brake_test()
    root = ET.fromstring(model.draw())
    texts = [one.text for one in root.iter("{http://www.w3.org/2000/svg}text")]
    assert texts == ["wheel", "ground", "wheel", "inertia", "brake", "clutch"]


def test_a_model_becomes_modelica_with_and_without_its_run() -> None:
    model, _, _ = _brake_test()
    assert "Components.Brake brake" in model.to_modelica()
    text = model.to_modelica(1.0)
    assert "StopTime=1.0" in text
    assert "der(driveline.wheel.flange_a.phi) = 4.0;" in text


def test_a_frame_has_a_column_per_quantity() -> None:
    pytest.importorskip("pandas")
    model, wheel, _ = _brake_test()
    run = model.simulate(np.array([0.0, 0.1, 0.2]))
    frame = run.to_frame()
    assert frame.index.name == "time"
    assert frame["speed wheel"].to_numpy() == pytest.approx(run[wheel.speed])
    assert "torque brake.b" in frame
