# SPDX-License-Identifier: MIT
"""Problem of the shift 3-4 of an eight-speed planetary gearbox: four sets, five shift elements."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from benchmarks.fit.problem import (
    Problem,
    Sensor,
    Sought,
    Source,
    Values,
    interpolate,
    make_grid,
    set_start,
)
from drivetwin.gearbox.card import load_gearbox
from drivetwin.gearbox.reduction import build_network_elements
from drivetwin.modeling.model import Model
from drivetwin.simulation.dual_clutch import Signal
from drivetwin.simulation.network import Element

CARD = "zf-8hp70"
RATIO = 2.1039
"""Ratio of third gear."""
INPUT_SPEED, TORQUE = 235.0, 330.0
"""Input speed [rad/s] and engine torque [N·m] at the start."""
FINAL = 3.15
MEMBERS = {"J S1-S2": "J_sun", "J R3-S4": "J_R3S4", "J R2-S3": "J_R2S3"}
"""Unknowns by the inertias of members that they set."""
SHIFTED = ("C", "D")
"""Elements that shift; they have one friction law."""
HOLDS = 80e5
"""Pressure at which an element holds throughout [Pa]."""


def build_planetary() -> Problem:
    """Return the shift 3-4 of the eight-speed gearbox: element C releases, element D engages."""
    time = make_grid(2.0, 1000.0)
    falls = [(0.0, 13.5e5), (0.63, 13.5e5), (0.65, 0.0)]
    rises = [(0.48, 0.0), (0.5, 0.7e5), (0.65, 1.65e5), (0.7, 1.85e5), (1.3, 1.95e5), (1.35, 11e5)]
    friction = tuple(f"{one}.friction" for one in SHIFTED)
    return Problem(
        name="planetary",
        text="shift 3-4 of an eight-speed planetary gearbox",
        assemble=_assemble,
        unknowns={
            "J1": Sought(0.25, ("J1.inertia",)),
            "J_sun": Sought(0.003, ("J S1-S2.inertia",)),
            "J_R3S4": Sought(0.004, ("J R3-S4.inertia",)),
            "J_R2S3": Sought(0.005, ("J R2-S3.inertia",)),
            "J_v": Sought(190.0, ("J_v.inertia",)),
            "load": Sought(250.0, ("load.constant",)),
            "k": Sought(1.0e4, ("output shaft.stiffness",)),
            "c": Sought(35.0, ("output shaft.damping",)),
            "mu_c": Sought(0.11, tuple(f"{one}.mu_c" for one in friction)),
            "mu_s": Sought(0.135, tuple(f"{one}.mu_s" for one in friction)),
            "v_s": Sought(15.0, tuple(f"{one}.v_s" for one in friction)),
            "p0": Sought(0.8e5, ("D.p0",)),
        },
        outputs={
            "input_speed": Sensor(("speed", "input"), 0.2),
            "drum_speed": Sensor(("speed", "R3-S4"), 0.2),
            "output_speed": Sensor(("speed", "output"), 0.1),
            "wheel_speed": Sensor(("speed", "wheel"), 0.03),
            "output_torque": Sensor(("shaft_torque", "output shaft"), 3.0),
        },
        inputs={
            "engine torque": Source(Signal(time, TORQUE + 25.0 * np.sin(8.0 * time)), 3.0),
            "A": Source(interpolate(time, (0.0, 0.0)), 0.0),
            "B": Source(interpolate(time, (0.0, HOLDS)), 0.0),
            "C": Source(interpolate(time, *falls), 2e3),
            "D": Source(interpolate(time, *rises), 2e3),
            "E": Source(interpolate(time, (0.0, HOLDS)), 0.0),
        },
        time=time,
        start=_start,
    )


def build_late_planetary() -> Problem:
    """Return the shift 3-4 with an unknown delay of the pressure of the engaging element."""
    base = build_planetary()
    late = Sought(0.025, ("delay.D",), 0.5)
    return replace(base, name="late planetary", unknowns={**base.unknowns, "late": late})


def _start(values: Values) -> Values:
    output = INPUT_SPEED / RATIO
    return {"output": output, "wheel": output / FINAL, "output shaft": 650.0 / values["k"]}


def _assemble(values: Values, start: Values) -> Model:
    gearbox = load_gearbox(CARD)
    model = Model("eight-speed gearbox")
    model.add_elements([_alter(one, values) for one in build_network_elements(gearbox)])
    model.inputs.update(dict.fromkeys("ABCDE", 0.0))
    model.inertia("J1", values["J1"], "input")
    model.torque("engine torque", "input", 0.0)
    model.spring_damper(
        "output shaft", "output", "axle", stiffness=values["k"], damping=values["c"]
    )
    model.gear("final drive", "axle", "wheel", ratio=FINAL)
    model.inertia("J_v", values["J_v"], "wheel")
    model.road_load("load", "wheel", constant=values["load"])
    set_start(model, start, ("output", "wheel"), ("output shaft",), locked=["B", "C", "E"])
    return model


def _alter(element: Element, values: Values) -> Element:
    """Return an element of the gearbox with the values of the unknowns."""
    name = element["name"]
    if name in MEMBERS:
        return {**element, "inertia": values[MEMBERS[name]]}
    if name not in SHIFTED:
        return element
    law = {**element["friction"], **{key: values[key] for key in ("mu_c", "mu_s", "v_s")}}
    return {**element, "friction": law, "p0": values["p0"] if name == "D" else element["p0"]}
