# SPDX-License-Identifier: MIT
"""A geared mass, a shaft, a second mass; equations in the README of this folder."""

from __future__ import annotations

import numpy as np

from drivetwin.simulation.network import Sine, Start
from reference.parts import inertia, spring, torque
from reference.problem import Phase, Problem

PROBLEM = Problem(
    elements=(
        inertia("motor", 0.1),
        torque("motor", "torque"),
        {"type": "gear", "name": "gear", "a": "motor", "b": "middle", "ratio": 10.0},
        inertia("middle", 2.0),
        spring("shaft", ("middle", "end"), 1e4, 0.0),
        spring("damper", ("middle", "ground"), 0.0, 10.0),
        inertia("end", 2.0),
    ),
    phases=(Phase(1.0, {"torque": Sine(10.0, 5.0)}),),
    start=Start({"middle": 0.0, "end": 0.0}),
    time=np.linspace(0.0, 1.0, 201),
    tolerance={
        ("speed", "end"): 1e-9,
        ("angle", "end"): 1e-10,
        ("speed", "middle"): 1e-9,
        ("angle", "middle"): 1e-10,
        ("shaft_torque", "shaft"): 1e-6,
    },
)
