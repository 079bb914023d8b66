# SPDX-License-Identifier: MIT
"""A gear pair with 50 % efficiency; equations in the README of this folder."""

from __future__ import annotations

import numpy as np

from drivetwin.simulation.network import Element, Sine, Start
from reference.parts import inertia, line, torque
from reference.problem import Phase, Problem

ELEMENTS: tuple[Element, ...] = (
    inertia("a", 1.0),
    inertia("b", 1.5),
    torque("a", "drive"),
    torque("b", "load"),
    {
        "type": "gear",
        "name": "gear",
        "a": "a",
        "b": "b",
        "ratio": 2.0,
        "loss": {"law": "dissipative", "eta": 0.5, "eta_backward": 0.5},
    },
)
PHASE = Phase(0.5, {"drive": Sine(10.0, 1.0), "load": line((0.0, 2.0), (-10.0, -5.0))})

PROBLEM = Problem(
    elements=ELEMENTS,
    phases=(PHASE,),
    start=Start({"b": 0.0}),
    time=np.linspace(0.0, 0.5, 201),
    tolerance={("speed", "a"): 1e-12, ("speed", "b"): 1e-12, ("angle", "b"): 1e-13},
    events_of=("gear",),
)
