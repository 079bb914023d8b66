# SPDX-License-Identifier: MIT
"""A planetary set shifted from brake to clutch; equations in the README of this folder."""

from __future__ import annotations

import numpy as np

from drivetwin.simulation.network import Start
from reference.parts import clutch, inertia, line, step, torque
from reference.problem import Phase, Problem

END = 5.0
NOMINAL_SPEED = 10.471975511966

PROBLEM = Problem(
    elements=(
        inertia("sun", 1.0),
        inertia("carrier", 10.0),
        torque("sun", "torque"),
        {
            "type": "planetary",
            "name": "set",
            "sun": "sun",
            "ring": "ring",
            "carrier": "carrier",
            "z": 1.5,
        },
        {
            "type": "road_load",
            "name": "load",
            "node": "carrier",
            "constant": 0.0,
            "rolling": 0.0,
            "aero": 20.0 / NOMINAL_SPEED**2,
        },
        clutch("clutch", ("sun", "ring"), 100.0),
        clutch("brake", ("ring", "ground"), 100.0),
    ),
    phases=(
        Phase(
            END,
            {
                "torque": step(0.5, (0.0, 20.0), END),
                "clutch": line((0.0, 2.0, 2.1, END), (0.0, 0.0, 1.0, 1.0)),
                "brake": line((0.0, 2.0, 2.1, END), (1.0, 1.0, 0.0, 0.0)),
            },
        ),
    ),
    start=Start({"sun": 0.0, "carrier": 0.0}),
    time=np.linspace(0.0, END, 251),
    tolerance={
        ("speed", "sun"): 1e-9,
        ("speed", "carrier"): 1e-9,
        ("speed", "ring"): 1e-9,
        ("angle", "sun"): 1e-9,
    },
    events_of=("clutch", "brake"),
)
