# SPDX-License-Identifier: MIT
"""One shaft held by two brakes at once; equations in the README of this folder."""

from __future__ import annotations

import numpy as np

from drivetwin.simulation.network import Start
from reference.parts import clutch, constant, inertia, line, torque
from reference.problem import Phase, Problem

END = 2.0

PROBLEM = Problem(
    elements=(
        inertia("shaft", 2.0),
        torque("shaft", "torque"),
        clutch("strong", ("shaft", "ground"), 100.0, peak=1.2),
        clutch("weak", ("shaft", "ground"), 40.0, peak=1.2),
    ),
    phases=(
        Phase(
            END,
            {
                "torque": line((0.0, 1.0, 1.5, END), (0.0, 180.0, 60.0, 155.0)),
                "strong": constant(1.0, END),
                "weak": constant(1.0, END),
            },
        ),
    ),
    start=Start({"shaft": 0.0}, locked=("strong", "weak")),
    time=np.linspace(0.0, END, 161),
    tolerance={
        ("speed", "shaft"): 1e-10,
        ("angle", "shaft"): 1e-10,
        ("friction_torque", "strong"): 1e-8,
        ("friction_torque", "weak"): 1e-8,
    },
    events_of=("strong", "weak"),
)
