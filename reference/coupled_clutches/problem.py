# SPDX-License-Identifier: MIT
"""Four masses joined by three clutches; equations in the README of this folder."""

from __future__ import annotations

import math

import numpy as np

from drivetwin.simulation.dual_clutch import FloatArray
from drivetwin.simulation.network import Output, Sine, Start
from reference.parts import clutch, inertia, step, torque
from reference.problem import Phase, Problem

SHAFTS = ("w1", "w2", "w3", "w4")
SPEEDS: tuple[Output, ...] = tuple(("speed", shaft) for shaft in SHAFTS)
TIME: FloatArray = np.linspace(0.0, 1.5, 151)

PROBLEM = Problem(
    elements=(
        *(inertia(shaft, 1.0) for shaft in SHAFTS),
        torque("w1", "torque"),
        clutch("c1", ("w1", "w2"), 10.0, peak=1.1),
        clutch("c2", ("w2", "w3"), 10.0, peak=1.1),
        clutch("c3", ("w3", "w4"), 10.0, peak=1.1),
    ),
    phases=(
        Phase(
            1.5,
            {
                "torque": Sine(10.0, 5.0),
                "c1": Sine(1.0, 0.2, math.pi / 2),
                "c2": step(0.4, (0.0, 1.0), 1.5),
                "c3": step(0.9, (0.0, 1.0), 1.5),
            },
        ),
    ),
    start=Start({"w1": 10.0, "w2": 0.0, "w3": 0.0, "w4": 0.0}),
    time=TIME,
    tolerance={**dict.fromkeys(SPEEDS, 1e-9), ("angle", "w1"): 1e-9},
    events_of=("c1", "c2", "c3"),
)
