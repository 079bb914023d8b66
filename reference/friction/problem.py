# SPDX-License-Identifier: MIT
"""Motor, clutch, shaft and braked mass; equations in the README of this folder."""

from __future__ import annotations

import math

import numpy as np

from drivetwin.simulation.network import Sine, Start
from reference.parts import clutch, constant, inertia, spring, torque
from reference.problem import Phase, Problem

END = 3.0
ON, OFF = constant(1.0, END), constant(0.0, END)

PROBLEM = Problem(
    elements=(
        inertia("motor", 1.0),
        torque("motor", "torque"),
        clutch("clutch", ("motor", "middle"), 80.0),
        inertia("middle", 0.05),
        spring("shaft", ("middle", "end"), 160.0, 1.0),
        inertia("end", 1.0),
        clutch("brake", ("end", "ground"), 800.0),
    ),
    phases=(
        Phase(0.5, {"torque": Sine(200.0, 50.0 / math.pi), "clutch": ON, "brake": OFF}),
        Phase(END, {"torque": OFF, "clutch": ON, "brake": ON}),
    ),
    start=Start({"motor": 100.0, "middle": 90.0, "end": 90.0}, {"shaft": 0.0}),
    time=np.linspace(0.0, END, 301),
    tolerance={
        ("speed", "motor"): 1e-8,
        ("speed", "middle"): 1e-8,
        ("speed", "end"): 1e-8,
        ("twist", "shaft"): 1e-9,
    },
    events_of=("clutch", "brake"),
)
