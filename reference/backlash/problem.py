# SPDX-License-Identifier: MIT
"""A mass on a shaft with play and one without; equations in the README of this folder."""

from __future__ import annotations

import math

import numpy as np

from drivetwin.simulation.network import Start
from reference.parts import inertia, spring
from reference.problem import Phase, Problem

PROBLEM = Problem(
    elements=(
        inertia("loose", 5.0),
        {
            "type": "backlash",
            "name": "play",
            "a": "loose",
            "b": "ground",
            "stiffness": 20e3,
            "damping": 50.0,
            "gap": math.pi / 4,
        },
        inertia("tight", 5.0),
        spring("shaft", ("tight", "ground"), 20e3, 50.0),
    ),
    phases=(Phase(1.0, {}),),
    start=Start({"loose": 0.0, "tight": 0.0}, {"play": math.pi / 2, "shaft": math.pi / 2}),
    time=np.linspace(0.0, 1.0, 201),
    tolerance={
        ("speed", "loose"): 1e-9,
        ("twist", "play"): 1e-10,
        ("speed", "tight"): 1e-9,
        ("twist", "shaft"): 1e-10,
        ("shaft_torque", "play"): 1e-6,
    },
)
