# SPDX-License-Identifier: MIT
"""A wheel with tyre slip behind a stiffening shaft; equations in the README of this folder."""

from __future__ import annotations

import numpy as np

from drivetwin.simulation.network import Start
from reference.parts import inertia, line, torque
from reference.problem import Phase, Problem

END = 4.5

PROBLEM = Problem(
    elements=(
        torque("motor", "torque"),
        inertia("motor", 0.5),
        {
            "type": "spring_table",
            "name": "shaft",
            "a": "motor",
            "b": "wheel",
            "twist": [-0.2, -0.05, 0.0, 0.05, 0.2],
            "torque": [-500.0, -60.0, 0.0, 50.0, 350.0],
            "damping": 2.0,
        },
        inertia("wheel", 2.0),
        {
            "type": "tyre",
            "name": "tyre",
            "a": "wheel",
            "b": "vehicle",
            "slip_stiffness": 3000.0,
            "least_speed": 4.0,
        },
        inertia("vehicle", 40.0),
        {
            "type": "road_load",
            "name": "load",
            "node": "vehicle",
            "constant": 0.0,
            "rolling": 0.0,
            "aero": 0.05,
        },
    ),
    phases=(Phase(END, {"torque": line((0.0, 0.6, 0.7, END), (150.0, 150.0, -200.0, -200.0))}),),
    start=Start({"motor": 10.0, "wheel": 10.0, "vehicle": 10.0}),
    time=np.linspace(0.0, END, 451),
    tolerance={
        ("speed", "motor"): 1e-8,
        ("speed", "wheel"): 1e-8,
        ("speed", "vehicle"): 1e-8,
        ("twist", "shaft"): 1e-10,
        ("shaft_torque", "shaft"): 1e-6,
    },
)
