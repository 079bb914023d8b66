# SPDX-License-Identifier: MIT
"""Problems with an engagement: K0 of a hybrid, launches, dual clutch, lock-up; and a tip-in."""

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


def build_engine_start() -> Problem:
    """Return the engagement of K0 that starts the engine of a P2 hybrid while driving."""
    time = make_grid(3.0, 1000.0)
    return Problem(
        name="engine start",
        text="K0 starts the engine of a P2 hybrid",
        assemble=_assemble_engine_start,
        unknowns={
            "Je": Sought(0.14, ("Je.inertia",)),
            "drag": Sought(12.0, ("drag.rolling",)),
            "mu_c": Sought(0.11, ("K0.friction.mu_c",)),
            "mu_s": Sought(0.13, ("K0.friction.mu_s",)),
            "Jm": Sought(0.05, ("Jm.inertia",)),
            "k": Sought(9000.0, ("shaft.stiffness",)),
            "c": Sought(12.0, ("shaft.damping",)),
            "Jv": Sought(25.0, ("Jv.inertia",)),
        },
        outputs={
            "engine_speed": Sensor(("speed", "engine"), 0.3),
            "motor_speed": Sensor(("speed", "motor"), 0.1),
            "wheel_speed": Sensor(("speed", "wheel"), 0.05),
        },
        inputs={
            "Te": Source(interpolate(time, (1.6, 0.0), (1.65, 40.0)), 1.5),
            "Tm": Source(Signal(time, 60.0 + 20.0 * np.sin(5.0 * time)), 0.5),
            "K0": Source(
                interpolate(time, (0.5, 0.0), (0.7, 1.2e5), (1.2, 1.6e5), (1.4, 8e5)), 1e3
            ),
        },
        time=time,
        start=lambda values: {
            "engine": 0.0,
            "motor": 120.0,
            "wheel": 120.0,
            "shaft": 60.0 / values["k"],
        },
        known=frozenset({"engine"}),
    )


def _assemble_engine_start(values: Values, start: Values) -> Model:
    model = Model("P2 hybrid")
    law = Stribeck(values["mu_c"], values["mu_s"], 15.0, 0.0)
    model.torque("Te", "engine", 0.0)
    model.inertia("Je", values["Je"], "engine")
    model.road_load("drag", "engine", rolling=values["drag"])
    plates = Plates(law, gain=0.01, p0=0.8e5)
    model.clutch("K0", "motor", "engine", pressure=0.0, plates=plates)
    model.torque("Tm", "motor", 0.0)
    model.inertia("Jm", values["Jm"], "motor")
    model.spring_damper("shaft", "motor", "wheel", stiffness=values["k"], damping=values["c"])
    model.inertia("Jv", values["Jv"], "wheel")
    set_start(model, start, ("engine", "motor", "wheel"), ("shaft",))
    return model


def build_launch() -> Problem:
    """Return the launch of a dual-clutch gearbox from standstill, second gear preselected."""
    time = make_grid(3.0, 200.0)
    return Problem(
        name="launch",
        text="launch of a dual-clutch gearbox",
        assemble=_assemble_launch,
        unknowns={
            "Je": Sought(0.22, ("Je.inertia",)),
            "J_in": Sought(0.03, ("J shaft 1.inertia",)),
            "mu_c": Sought(0.11, ("K1.friction.mu_c",)),
            "mu_s": Sought(0.13, ("K1.friction.mu_s",)),
            "p0": Sought(0.8e5, ("K1.p0",)),
            "k": Sought(9000.0, ("half shafts.stiffness",)),
            "c": Sought(40.0, ("half shafts.damping",)),
            "Jv": Sought(150.0, ("Jv.inertia",)),
            "rolling": Sought(250.0, ("load.rolling",)),
        },
        outputs={
            "engine_speed": Sensor(("speed", "engine"), 0.3),
            "input_speed": Sensor(("speed", "shaft 1"), 0.2),
            "wheel_speed": Sensor(("speed", "wheel"), 0.02),
        },
        inputs={
            "Te": Source(
                interpolate(time, (0.2, 0.0), (0.7, 150.0), (2.0, 160.0), (2.2, 120.0)), 0.5
            ),
            "K1": Source(
                interpolate(
                    time, (0.1, 0.3e5), (0.3, 0.9e5), (0.9, 2.2e5), (1.8, 2.4e5), (2.1, 6e5)
                ),
                0.3e3,
            ),
            "K2": Source(interpolate(time, (0.0, 0.5e5)), 0.3e3),
        },
        time=time,
        start=lambda _: {"engine": 95.0, "axle": 0.0, "wheel": 0.0, "half shafts": 0.0},
        known=frozenset({"axle", "wheel", "half shafts"}),
    )


def _assemble_launch(values: Values, start: Values) -> Model:
    law = Stribeck(values["mu_c"], values["mu_s"], 15.0, 0.0)
    first = Plates(law, gain=0.01, p0=values["p0"])
    second = Plates(Stribeck(0.11, 0.13, 15.0, 0.0), gain=0.01, p0=0.8e5)
    model = _build_dual_clutch(values, first, second)
    set_start(model, start, ("engine", "wheel", "axle"), ("half shafts",), locked=["load"])
    return model


def _build_dual_clutch(values: Values, first: Plates, second: Plates) -> Model:
    model = Model("dual-clutch gearbox")
    model.torque("Te", "engine", 0.0)
    model.inertia("Je", values["Je"], "engine")
    model.clutch("K1", "engine", "shaft 1", pressure=0.0, plates=first)
    model.clutch("K2", "engine", "shaft 2", pressure=0.0, plates=second)
    model.inertia("J shaft 1", values["J_in"], "shaft 1")
    model.inertia("J shaft 2", 0.02, "shaft 2")
    model.gear("first", "shaft 1", "out", ratio=3.9)
    model.gear("second", "shaft 2", "out", ratio=2.3)
    model.gear("final drive", "out", "axle", ratio=3.8)
    model.spring_damper("half shafts", "axle", "wheel", stiffness=values["k"], damping=values["c"])
    model.inertia("Jv", values["Jv"], "wheel")
    model.road_load("load", "wheel", rolling=values["rolling"], aero=0.03)
    return model


def build_dual_clutch() -> Problem:
    """Return the shift 1-2 of a dual-clutch gearbox, the delays of both pressures unknown."""
    time = make_grid(2.5, 1000.0)
    base = build_launch()
    shared = {
        key: tuple(f"{one}.friction.{key}" for one in ("K1", "K2")) for key in ("mu_c", "mu_s")
    }
    unknowns = {
        **base.unknowns,
        **{key: Sought(base.unknowns[key].truth, paths) for key, paths in shared.items()},
        "p0": Sought(0.8e5, ("K2.p0",)),
        "late 1": Sought(0.02, ("delay.K1",), 0.5),
        "late 2": Sought(0.03, ("delay.K2",), 0.5),
    }
    del unknowns["J_in"]
    return Problem(
        name="dual clutch",
        text="shift 1-2 of a dual-clutch gearbox with late pressures",
        assemble=_assemble_dual_clutch,
        unknowns=unknowns,
        outputs=base.outputs,
        inputs={
            "Te": Source(interpolate(time, (0.2, 100.0), (0.4, 150.0), (1.8, 130.0)), 1.0),
            "K1": Source(interpolate(time, (0.7, 6e5), (0.9, 1.5e5), (1.1, 0.4e5)), 1e3),
            "K2": Source(
                interpolate(time, (0.6, 0.6e5), (1.1, 2.3e5), (1.9, 2.7e5), (2.0, 6e5)), 1e3
            ),
        },
        time=time,
        start=lambda values: {
            "axle": 320.0 / (3.9 * 3.8),
            "wheel": 320.0 / (3.9 * 3.8),
            "half shafts": 1400.0 / values["k"],
        },
    )


def _assemble_dual_clutch(values: Values, start: Values) -> Model:
    law = Stribeck(values["mu_c"], values["mu_s"], 15.0, 0.0)
    model = _build_dual_clutch(
        {**values, "J_in": 0.03},
        Plates(law, gain=0.01, p0=0.8e5),
        Plates(law, gain=0.01, p0=values["p0"]),
    )
    set_start(model, start, ("axle", "wheel"), ("half shafts",), locked=["K1"])
    return model


def build_truck_start() -> Problem:
    """Return the start of a heavy truck with a dry clutch."""
    time = make_grid(4.0, 200.0)
    return Problem(
        name="truck start",
        text="start of a heavy truck",
        assemble=_assemble_truck_start,
        unknowns={
            "Je": Sought(4.0, ("Je.inertia",)),
            "mu_c": Sought(0.3, ("clutch.friction.mu_c",)),
            "mu_s": Sought(0.33, ("clutch.friction.mu_s",)),
            "p0": Sought(1.2e5, ("clutch.p0",)),
            "k": Sought(9.0e4, ("half shafts.stiffness",)),
            "c": Sought(600.0, ("half shafts.damping",)),
            "Jv": Sought(9000.0, ("Jv.inertia",)),
            "rolling": Sought(8000.0, ("load.rolling",)),
            "late": Sought(0.04, ("delay.clutch",), 0.5),
        },
        outputs={
            "engine_speed": Sensor(("speed", "engine"), 0.3),
            "input_speed": Sensor(("speed", "input"), 0.2),
            "wheel_speed": Sensor(("speed", "wheel"), 0.01),
        },
        inputs={
            "Te": Source(interpolate(time, (0.2, 0.0), (1.0, 700.0), (3.0, 900.0)), 5.0),
            "clutch": Source(
                interpolate(time, (0.2, 0.8e5), (0.5, 1.5e5), (1.8, 4.2e5), (3.2, 8e5)), 1e3
            ),
        },
        time=time,
        start=lambda _: {"engine": 80.0, "axle": 0.0, "wheel": 0.0, "half shafts": 0.0},
        known=frozenset({"axle", "wheel", "half shafts"}),
    )


def _assemble_truck_start(values: Values, start: Values) -> Model:
    model = Model("truck start")
    model.torque("Te", "engine", 0.0)
    model.inertia("Je", values["Je"], "engine")
    law = Stribeck(values["mu_c"], values["mu_s"], 15.0, 0.0)
    plates = Plates(law, gain=0.01, p0=values["p0"])
    model.clutch("clutch", "engine", "input", pressure=0.0, plates=plates)
    model.inertia("J input", 0.4, "input")
    model.gear("gear", "input", "axle", ratio=36.0)
    model.spring_damper("half shafts", "axle", "wheel", stiffness=values["k"], damping=values["c"])
    model.inertia("Jv", values["Jv"], "wheel")
    model.road_load("load", "wheel", rolling=values["rolling"])
    set_start(model, start, ("engine", "wheel", "axle"), ("half shafts",), locked=["load"])
    return model


def build_tip_in() -> Problem:
    """Return the tip-in of an electric drive through play, and the tip-out after it."""
    time = make_grid(4.0, 1000.0)
    steps = [(0.5, -20.0), (0.52, 180.0), (2.5, 180.0), (2.52, -40.0)]
    return Problem(
        name="tip-in",
        text="tip-in and tip-out through play",
        assemble=_assemble_tip_in,
        unknowns={
            "Jm": Sought(0.08, ("Jm.inertia",)),
            "k": Sought(9000.0, ("play.stiffness",)),
            "c": Sought(6.0, ("play.damping",)),
            "gap": Sought(0.02, ("play.gap",)),
            "Jv": Sought(20.0, ("Jv.inertia",)),
        },
        outputs={
            "motor_speed": Sensor(("speed", "motor"), 0.1),
            "wheel_speed": Sensor(("speed", "wheel"), 0.03),
        },
        inputs={"Tm": Source(interpolate(time, *steps), 1.0)},
        time=time,
        start=lambda values: {
            "motor": 100.0,
            "wheel": 100.0,
            "play": -0.5 * values["gap"] - 20.0 / values["k"],
        },
    )


def _assemble_tip_in(values: Values, start: Values) -> Model:
    model = Model("electric drive with play")
    model.torque("Tm", "motor", 0.0)
    model.inertia("Jm", values["Jm"], "motor")
    fields = {"stiffness": values["k"], "damping": values["c"], "gap": values["gap"]}
    model.backlash("play", "motor", "wheel", **fields)
    model.inertia("Jv", values["Jv"], "wheel")
    set_start(model, start, ("motor", "wheel"), ("play",))
    return model


def build_lock_up() -> Problem:
    """Return the engagement of the lock-up clutch beside a torque converter, under load."""
    time = make_grid(4.0, 200.0)
    pressure = [(1.0, 0.4e5), (1.1, 1.0e5), (2.3, 2.2e5), (2.5, 6e5)]
    return Problem(
        name="lock-up",
        text="lock-up of a torque converter",
        assemble=_assemble_lock_up,
        unknowns={
            "Je": Sought(0.25, ("Je.inertia",)),
            "Jt": Sought(0.06, ("Jt.inertia",)),
            "mu_c": Sought(0.11, ("LC.friction.mu_c",)),
            "mu_s": Sought(0.135, ("LC.friction.mu_s",)),
            "p0": Sought(0.6e5, ("LC.p0",)),
            "k": Sought(9000.0, ("half shafts.stiffness",)),
            "c": Sought(30.0, ("half shafts.damping",)),
            "Jv": Sought(170.0, ("Jv.inertia",)),
            "load": Sought(400.0, ("load.constant",)),
        },
        outputs={
            "engine_speed": Sensor(("speed", "engine"), 0.3),
            "turbine_speed": Sensor(("speed", "turbine"), 0.2),
            "wheel_speed": Sensor(("speed", "wheel"), 0.02),
        },
        inputs={
            "Te": Source(
                interpolate(time, (0.3, 100.0), (0.35, 160.0), (3.0, 160.0), (3.05, 110.0)), 1.5
            ),
            "LC": Source(interpolate(time, *pressure), 1e3),
        },
        time=time,
        start=lambda values: {
            "engine": 190.0,
            "turbine": 160.0,
            "wheel": 160.0 / 7.35,
            "half shafts": 750.0 / values["k"],
        },
    )


def _assemble_lock_up(values: Values, start: Values) -> Model:
    model = Model("converter lock-up")
    model.torque("Te", "engine", 0.0)
    model.inertia("Je", values["Je"], "engine")
    converter = {
        "speed_ratio": [0.0, 0.8, 0.95, 1.0, 1.2],
        "capacity": [3.4e-3, 2.4e-3, 1.2e-3, 0.0, -1.5e-3],
        "torque_ratio": [1.9, 1.1, 1.0, 1.0, 1.0],
    }
    model.torque_converter("converter", "engine", "turbine", map=converter)
    law = Stribeck(values["mu_c"], values["mu_s"], 8.0, 0.0)
    plates = Plates(law, gain=0.01, p0=values["p0"])
    model.clutch("LC", "engine", "turbine", pressure=0.0, plates=plates)
    model.inertia("Jt", values["Jt"], "turbine")
    model.gear("gear", "turbine", "out", ratio=2.1)
    model.gear("final drive", "out", "axle", ratio=3.5)
    model.spring_damper("half shafts", "axle", "wheel", stiffness=values["k"], damping=values["c"])
    model.inertia("Jv", values["Jv"], "wheel")
    model.road_load("load", "wheel", constant=values["load"], aero=0.03)
    set_start(model, start, ("engine", "turbine", "wheel"), ("half shafts",))
    return model
