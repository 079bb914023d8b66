# SPDX-License-Identifier: MIT
"""Problem of a shift under load with a compliant input shaft and an unknown ratio."""

from __future__ import annotations

import numpy as np

from benchmarks.fit.problem import (
    Problem,
    Sensor,
    Sought,
    Source,
    Values,
    interpolate,
    make_grid,
    set_start,
)
from drivetwin.modeling.model import Model
from drivetwin.modeling.model_components import Plates
from drivetwin.simulation.dual_clutch import Signal, Stribeck

RATIO_2, FINAL = 2.143, 4.0
"""Known ratios of second gear and final drive."""
LOADED = 2500.0
"""Torque of the output shaft before the shift [N·m], for the guess of its twist."""


def build_shift() -> Problem:
    """Return the shift 2-3 of a truck with a compliant input shaft and an unknown third ratio."""
    time = make_grid(4.0, 1000.0)
    falls = np.clip((time - 1.2) / 0.25, 0.0, 1.0)
    on_coming = [(1.3, 0.7e5), (1.5, 4.5e5), (1.9, 5e5), (2.1, 14e5)]
    return Problem(
        name="shift",
        text="shift 2-3 with input shaft and unknown third ratio",
        assemble=_assemble_shift,
        unknowns={
            "J1a": Sought(8.0, ("J1a.inertia",)),
            "k_in": Sought(320e3, ("input shaft.stiffness",)),
            "c_in": Sought(60.0, ("input shaft.damping",)),
            "J1b": Sought(8.0, ("J1b.inertia",)),
            "ratio_3": Sought(1.31, ("third.ratio",)),
            "k_o": Sought(176e3, ("output shaft.stiffness",)),
            "c_o": Sought(280.0, ("output shaft.damping",)),
            "Jv": Sought(6000.0, ("Jv.inertia",)),
            "Tv": Sought(9200.0, ("load.constant",)),
            "mu_c": Sought(0.115, ("B2.friction.mu_c", "B3.friction.mu_c")),
            "mu_s": Sought(0.13, ("B2.friction.mu_s", "B3.friction.mu_s")),
        },
        outputs={
            "engine_speed": Sensor(("speed", "crank"), 0.1),
            "output_speed": Sensor(("speed", "out"), 0.05),
            "wheel_speed": Sensor(("speed", "wheel"), 0.02),
            "output_torque": Sensor(("shaft_torque", "output shaft"), 15.0),
        },
        inputs={
            "Te": Source(Signal(time, 1540.0 + 120.0 * np.sin(9.0 * time)), 15.0),
            "B2": Source(Signal(time, 14e5 * (1.0 - falls)), 2e3),
            "B3": Source(interpolate(time, *on_coming), 2e3),
        },
        time=time,
        start=_start_shift,
    )


def _start_shift(values: Values) -> Values:
    speed = 150.0
    return {
        "crank": speed,
        "in": speed,
        "wheel": speed / RATIO_2 / FINAL,
        "input shaft": 1480.0 / values["k_in"],
        "output shaft": LOADED / values["k_o"],
    }


def _assemble_shift(values: Values, start: Values) -> Model:
    model = Model("shift with input shaft")
    law = Stribeck(values["mu_c"], values["mu_s"], 12.0, 3e-5)
    plates = Plates(law, gain=0.06, p0=0.8e5)
    model.torque("Te", "crank", 0.0)
    model.inertia("J1a", values["J1a"], "crank")
    model.spring_damper(
        "input shaft", "crank", "in", stiffness=values["k_in"], damping=values["c_in"]
    )
    model.inertia("J1b", values["J1b"], "in")
    model.gear("second", "in", "drum 2", ratio=RATIO_2)
    model.clutch("B2", "drum 2", "out", pressure=0.0, plates=plates)
    model.gear("third", "in", "drum 3", ratio=values["ratio_3"])
    model.clutch("B3", "drum 3", "out", pressure=0.0, plates=plates)
    model.inertia("Jo", 0.9, "out")
    model.spring_damper(
        "output shaft", "out", "axle", stiffness=values["k_o"], damping=values["c_o"]
    )
    model.gear("final drive", "axle", "wheel", ratio=FINAL)
    model.inertia("Jv", values["Jv"], "wheel")
    model.road_load("load", "wheel", constant=values["Tv"])
    shafts = ("input shaft", "output shaft")
    set_start(model, start, ("crank", "in", "wheel"), shafts, locked=["B2"])
    return model
