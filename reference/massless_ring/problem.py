# SPDX-License-Identifier: MIT
"""A planetary set whose braked ring has no inertia; equations in the README of this folder."""

from __future__ import annotations

import numpy as np

from drivetwin.simulation.network import Start
from reference.parts import inertia, line, torque
from reference.problem import Phase, Problem

END = 2.0

PROBLEM = Problem(
    elements=(
        inertia("sun", 0.05),
        torque("sun", "torque"),
        {
            "type": "planetary",
            "name": "set",
            "sun": "sun",
            "ring": "ring",
            "carrier": "carrier",
            "z": 2.2,
        },
        inertia("carrier", 2.0),
        {
            "type": "road_load",
            "name": "load",
            "node": "carrier",
            "constant": 12.0,
            "rolling": 0.0,
            "aero": 0.03,
        },
        {
            "type": "clutch",
            "name": "brake",
            "a": "ring",
            "b": "ground",
            "friction": {"mu_c": 0.10, "mu_s": 0.13, "v_s": 8.0, "mu_v": 2e-4},
            "gain": 2e-3,
            "p0": 5e4,
            "peak": 1.15,
            "pressure": "brake",
            "drum_inertia": 0.0,
        },
    ),
    phases=(
        Phase(
            END,
            {
                "torque": line(
                    (0.0, 0.6, 0.6, 0.9, 1.2, 1.6, END), (10.0, 10.0, 40.0, 40.0, 8.0, -25.0, 5.0)
                ),
                "brake": line((0.0, 0.1, 0.4, END), (0.0, 4e4, 25e4, 25e4)),
            },
        ),
    ),
    start=Start({"sun": 30.0, "carrier": 20.0}),
    time=np.linspace(0.0, END, 201),
    tolerance={
        ("speed", "sun"): 1e-8,
        ("speed", "ring"): 1e-8,
        ("speed", "carrier"): 1e-9,
        ("angle", "carrier"): 1e-9,
    },
    events_of=("brake",),
)
