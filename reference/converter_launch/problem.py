# SPDX-License-Identifier: MIT
"""A launch from standstill with a torque converter; equations in the README of this folder."""

from __future__ import annotations

import numpy as np

from drivetwin.simulation.network import Start
from reference.parts import inertia, line
from reference.problem import Phase, Problem

END = 6.0

PROBLEM = Problem(
    elements=(
        inertia("engine", 3.0),
        {
            "type": "engine_map",
            "name": "engine map",
            "node": "engine",
            "throttle": "throttle",
            "map": {
                "throttle": [0.0, 0.4, 1.0],
                "speed": [60.0, 120.0, 180.0, 240.0],
                "torque": [
                    [40.0, -60.0, -120.0, -180.0],
                    [500.0, 620.0, 540.0, 300.0],
                    [900.0, 1250.0, 1150.0, 800.0],
                ],
            },
            "lag": 0.2,
        },
        {
            "type": "torque_converter",
            "name": "converter",
            "pump": "engine",
            "turbine": "turbine",
            "map": {
                "speed_ratio": [0.0, 0.5, 0.85, 1.0, 1.3],
                "capacity": [0.036, 0.031, 0.020, 0.0, -0.012],
                "torque_ratio": [1.9, 1.4, 1.0, 1.0, 1.0],
            },
        },
        {
            "type": "clutch",
            "name": "lock-up",
            "a": "engine",
            "b": "turbine",
            "friction": {"slip": [0.0, 20.0, 100.0], "mu": [0.12, 0.105, 0.11]},
            "gain": 0.02,
            "p0": 1e5,
            "peak": 1.0,
            "pressure": "lock-up",
            "drum_inertia": 0.0,
        },
        inertia("turbine", 0.4),
        {"type": "gear", "name": "gear", "a": "turbine", "b": "axle", "ratio": 15.0},
        inertia("axle", 2500.0),
        {
            "type": "road_load",
            "name": "load",
            "node": "axle",
            "constant": 0.0,
            "rolling": 700.0,
            "aero": 0.9,
        },
    ),
    phases=(
        Phase(
            END,
            {
                "throttle": line((0.0, 0.2, 0.8, 4.8, 5.0, END), (0.0, 0.0, 0.7, 0.7, 0.0, 0.0)),
                "lock-up": line((0.0, 2.5, 3.3, END), (0.0, 0.0, 8e5, 8e5)),
            },
        ),
    ),
    start=Start({"engine": 70.0, "axle": 0.0}, locked=("load",)),
    time=np.linspace(0.0, END, 241),
    tolerance={
        ("speed", "engine"): 1e-7,
        ("speed", "turbine"): 1e-7,
        ("angle", "axle"): 1e-8,
    },
    events_of=("lock-up", "load"),
)
