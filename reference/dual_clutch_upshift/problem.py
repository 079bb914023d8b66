# SPDX-License-Identifier: MIT
"""A power-on upshift of the dual-clutch driveline; equations in the README of this folder."""

from __future__ import annotations

import numpy as np

from drivetwin.simulation.network import Element, Output, Start
from reference.parts import inertia, line, spring, torque
from reference.problem import Phase, Problem

WET = {"mu_c": 0.110, "mu_s": 0.135, "v_s": 15.0, "mu_v": 1e-4}
FINAL_DRIVE = 5.38
STIFFNESS, DAMPING = 1.76e5, 280.0


def gear(name: str, a: str, b: str, ratio: float) -> Element:
    """A gear pair without loss."""
    return {"type": "gear", "name": name, "a": a, "b": b, "ratio": ratio}


def shift_element(name: str, ratio: float, gain: float) -> tuple[Element, ...]:
    """A brake in the dual-clutch picture, with slip `ω_in/i_c - i_out ω_out` (THEORY section 2)."""
    drive, drum = f"{name} drive", f"{name} drum"
    return (
        gear(f"{name} in", "input", drive, ratio - 1.0),
        gear(f"{name} out", drum, "output", ratio / (ratio - 1.0)),
        {
            "type": "clutch",
            "name": name,
            "a": drive,
            "b": drum,
            "friction": WET,
            "gain": gain,
            "p0": 80e3,
            "peak": 1.0,
            "pressure": name,
            "drum_inertia": 0.0,
        },
    )


ELEMENTS: tuple[Element, ...] = (
    inertia("engine", 20.3),
    torque("engine", "torque"),
    {**gear("gearbox", "engine", "input", 1.0), "loss": {"law": "paper", "eta": 0.85}},
    *shift_element("B2", 1.91, 0.0378),
    *shift_element("B3", 1.43, 0.027),
    inertia("output", 0.9),
    spring("shaft", ("output", "axle"), STIFFNESS, DAMPING),
    gear("final drive", "axle", "wheel", FINAL_DRIVE),
    inertia("wheel", 6056.0),
    {
        "type": "road_load",
        "name": "load",
        "node": "wheel",
        "constant": 2300.0 * FINAL_DRIVE,
        "rolling": 0.0,
        "aero": 0.0,
    },
)
OUTPUT_SPEED = 178.0 / 1.91
START = Start(
    {"engine": 178.0, "output": OUTPUT_SPEED, "wheel": OUTPUT_SPEED / FINAL_DRIVE},
    {"shaft": 2460.0 / STIFFNESS},
    ("B2",),
)
TOLERANCE: dict[Output, float] = {
    ("speed", "engine"): 1e-8,
    ("speed", "output"): 1e-8,
    ("speed", "wheel"): 1e-8,
    ("twist", "shaft"): 1e-11,
    ("shaft_torque", "shaft"): 1e-6,
}

PROBLEM = Problem(
    elements=ELEMENTS,
    phases=(
        Phase(
            1.4,
            {
                "torque": line(
                    (0.0, 0.45, 0.55, 0.80, 0.95, 1.4),
                    (1545.0, 1545.0, 900.0, 900.0, 1545.0, 1545.0),
                ),
                "B2": line((0.0, 0.28, 0.30, 0.42, 1.4), (14e5, 14e5, 4.5e5, 0.0, 0.0)),
                "B3": line(
                    (0.0, 0.10, 0.15, 0.28, 0.44, 0.75, 1.0, 1.4),
                    (0.0, 0.0, 1.0e5, 1.0e5, 5.2e5, 4.6e5, 12e5, 12e5),
                ),
            },
        ),
    ),
    start=START,
    time=np.linspace(0.0, 1.4, 281),
    tolerance=TOLERANCE,
    events_of=("B2", "B3"),
)
