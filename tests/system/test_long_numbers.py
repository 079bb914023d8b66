# SPDX-License-Identifier: MIT
"""Numbers of 400 digits and infinities at every entry of the simulation: a typed error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.modeling.model import Model
from drivetwin.simulation.driveline_run import simulate as simulate_dual_clutch
from drivetwin.simulation.dual_clutch import (
    Accuracy,
    RoadLoad,
    Signal,
    State,
)
from drivetwin.simulation.linearize import linearise
from drivetwin.simulation.network import Sine, Start, simulate
from drivetwin.simulation.network_response import NetworkScenario, simulate_network_batch
from tests.export.cases import paper_model

LONG: list[Any] = [-(10**400), 10**5000, np.inf]
NAMES = ["400 digits", "5000 digits", "inf"]
GRID = np.linspace(0.0, 1.0, 3)
ONE = Signal(np.array([0.0, 1.0]), np.array([1.0, 1.0]))
REST = State(10.0, 1.0, 1.0, 0.0)
MODEL = paper_model()
PRESSURES = {element.name: ONE for element in MODEL.elements}


def run_network(
    field: dict[str, Any] | None = None,
    torque: Any = ONE,
    start: Any = None,
    time: Any = GRID,
) -> None:
    """Simulate an inertia on a shaft under a torque, with the parts given."""
    elements: list[dict[str, Any]] = [
        {"type": "inertia", "name": "J", "node": "x", "inertia": 1.0} | (field or {}),
        {"type": "torque", "name": "T", "node": "x", "input": "T"},
        {"type": "spring_damper", "name": "S", "a": "x", "b": "ground"}
        | {"stiffness": 1.0, "damping": 0.0},
    ]
    start = start or Start({"x": 1.0})
    simulate(elements, {"T": torque}, start, time, [("speed", "x")])


def run_dual_clutch(model: Any = MODEL, start: State = REST) -> None:
    simulate_dual_clutch(model, ONE, PRESSURES, start, GRID)


def build_wheel(torque: Any = 1.0, speed: Any = 0.0) -> Model:
    """Build a wheel under a torque."""
    model = Model("m")
    wheel = model.inertia("wheel", 2.0)
    model.torque("T", wheel, torque)
    model.start({wheel: speed})
    return model


ENTRIES: dict[str, Callable[[Any], object]] = {
    "field": lambda value: run_network({"inertia": value}),
    "start speed": lambda value: run_network(start=Start({"x": value})),
    "start twist": lambda value: run_network(start=Start({"x": 1.0}, {"S": value})),
    "sine amplitude": lambda value: run_network(torque=Sine(value, 1.0)),
    "sine frequency": lambda value: run_network(torque=Sine(1.0, value)),
    "values": lambda value: run_network(torque=Signal(ONE.time, [value, 1.0])),  # type: ignore[arg-type]
    "times": lambda value: run_network(torque=Signal([0.0, value], ONE.values)),  # type: ignore[arg-type]
    "delay": lambda value: run_network(torque=Signal(ONE.time, ONE.values, value)),
    "grid": lambda value: run_network(time=[0.0, value]),
    "tolerance": lambda value: Accuracy(tolerance=value),
    "order": lambda value: Accuracy(order=value),
    "parameter": lambda value: run_dual_clutch(replace(MODEL, J1=value)),
    "load": lambda value: run_dual_clutch(replace(MODEL, load=RoadLoad(value))),
    "start of a dual clutch": lambda value: run_dual_clutch(start=replace(REST, twist=value)),
    "derivative": lambda value: build_wheel().differentiate(1.0, {"J": {"wheel.inertia": value}}),
    "batch": lambda value: simulate_network_batch(
        [{"type": "inertia", "name": "J", "node": "x", "inertia": value}],
        [NetworkScenario({}, Start({"x": 1.0}))],
        GRID,
        [("speed", "x")],
    ),
    "modelled torque": lambda value: build_wheel(torque=value).simulate(1.0),
    "modelled speed": lambda value: build_wheel(speed=value).simulate(1.0),
    "modelled end": lambda value: build_wheel().simulate(value),
    "linear model": lambda value: linearise(replace(MODEL, J_v=value), ()),
}


@pytest.mark.parametrize("value", LONG, ids=NAMES)
@pytest.mark.parametrize("entry", ENTRIES)
def test_a_number_that_no_float_holds_is_refused(entry: str, value: Any) -> None:
    with pytest.raises(InputError) as raised:
        ENTRIES[entry](value)
    assert len(str(raised.value)) < 400


@pytest.mark.parametrize("value", [10**400, -(10**400)])
def test_a_longest_step_that_no_float_holds_is_refused(value: int) -> None:
    with pytest.raises(InputError, match="max_step"):
        Accuracy(max_step=value)
