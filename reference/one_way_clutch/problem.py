# SPDX-License-Identifier: MIT
"""A freewheel with a friction clutch beside it; equations in the README of this folder."""

from __future__ import annotations

import numpy as np

from drivetwin.simulation.network import Sine, Start
from reference.parts import inertia, line, torque
from reference.problem import Phase, Problem

PULSES = line((0.0, 0.3, 0.3, 0.95, 0.95, 1.6, 1.6, 2.0), (0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0))
BESIDE = {
    "friction": {"slip": [0.0], "mu": [0.5]},
    "gain": 3.0,
    "p0": 0.0,
    "peak": 25.0,
    "pressure": "engaged",
}

PROBLEM = Problem(
    elements=(
        inertia("in", 1.0),
        inertia("out", 1.0),
        torque("in", "torque"),
        {"type": "one_way_clutch", "name": "freewheel", "a": "in", "b": "out", "clutch": BESIDE},
    ),
    phases=(Phase(2.0, {"torque": Sine(10.0, 3.0), "engaged": PULSES}),),
    start=Start({"in": -0.5, "out": 0.0}),
    time=np.linspace(0.0, 2.0, 201),
    tolerance={
        ("speed", "in"): 1e-9,
        ("speed", "out"): 1e-9,
        ("angle", "in"): 1e-9,
        ("angle", "out"): 1e-9,
    },
    events_of=("freewheel",),
)
