# SPDX-License-Identifier: MIT
"""A driven shaft against a brake; equations in the README of this folder."""

from __future__ import annotations

import numpy as np

from drivetwin.simulation.network import Start
from reference.parts import clutch, constant, inertia, line, spring
from reference.problem import Phase, Problem

END = 2.0

PROBLEM = Problem(
    elements=(
        {"type": "prescribed_speed", "name": "drive", "node": "motor", "input": "speed"},
        inertia("motor", 1.0),
        clutch("brake", ("motor", "ground"), 30.0),
        clutch("clutch", ("motor", "load"), 10.0, peak=1.2),
        inertia("load", 0.5),
        spring("shaft", ("load", "end"), 200.0, 1.0),
        inertia("end", 0.2),
    ),
    phases=(
        Phase(
            END,
            {
                "speed": line(
                    (0.0, 0.1, 0.6, 1.0, 1.3, 1.6, END), (0.0, 0.0, 20.0, 20.0, 0.0, 0.0, -3.0)
                ),
                "brake": constant(1.0, END),
                "clutch": constant(1.0, END),
            },
        ),
    ),
    start=Start({"motor": 0.0, "load": 0.0, "end": 0.0}, {"shaft": 0.0}, ("brake", "clutch")),
    time=np.linspace(0.0, END, 201),
    tolerance={
        ("speed", "motor"): 1e-9,
        ("speed", "load"): 1e-9,
        ("speed", "end"): 1e-9,
        ("twist", "shaft"): 1e-10,
        ("slip", "brake"): 1e-9,
    },
    events_of=("brake", "clutch"),
)
