# SPDX-License-Identifier: MIT
"""The stated shift in drivetwin: inside Rust, through Python, with derivatives."""

from __future__ import annotations

import numpy as np

from benchmarks.speed.core import Example, Scenario
from benchmarks.speed.measure import Entry, Group, Judge, Quality, timed
from benchmarks.speed.statement import Inputs, Problem, Solution, start
from drivetwin.driveline import (
    ENGINE_TORQUE,
    DualClutch,
    RoadLoad,
    Sensitivities,
    ShiftElement,
    Signal,
    State,
    Stribeck,
    Trajectory,
    sensitivities,
    simulate,
)
from drivetwin.export.modelica.dual_clutch import SHAFT, network_of, network_start
from drivetwin.network import Output

PROGRAM = "drivetwin"
READY = "in Rust, network ready"
FIRST = "in Rust, first run of a network"
WHOLE = "in Rust, from the elements on"
PYTHON = "called from Python, nine columns"
_REPEATS = 20
_CLUTCHES = ("2", "3")
OUTPUTS: tuple[Output, ...] = (
    *(("speed", "engine"), ("speed", "output"), ("speed", "wheel")),
    ("shaft_torque", SHAFT),
)
PARAMETERS = (
    *("J1", "eta", "J_out", "J_v", "k_o", "c_o", "i_f", "load.constant"),
    *("2.gain", "3.gain", "2.P0", "3.P0", "3.mu_c", "3.mu_s", "3.v_s", "3.mu_v"),
)
"""The sixteen that derivatives are taken for."""
DERIVED = f"{len(PARAMETERS)} parameters, called from Python"


def judge(reference: Solution) -> Judge:
    """Largest deviation of T_o, and of an event where all are found."""

    def compare(found: Solution) -> Quality:
        error = float(np.abs(found.columns[3] - reference.columns[3]).max())
        same = found.events.size == reference.events.size
        events = float(np.abs(found.events - reference.events).max()) if same else None
        return Quality(error, "N·m", events)

    return compare


def model_of(of: Problem) -> DualClutch:
    """The problem's parameters; J_e is all that can be told of J1·η + J2e."""
    law = Stribeck(of.mu_c, of.mu_s, of.v_s, of.mu_v)
    elements = tuple(
        ShiftElement(name, of.i_c[n], of.i_out[n], of.gain[n], of.P0[n], law)
        for n, name in enumerate(_CLUTCHES)
    )
    return DualClutch(
        J1=of.J_e / of.eta,
        J2e=0.0,
        eta=of.eta,
        loss_law="paper",
        i_in=of.i_in,
        J_out=of.J_out,
        i_f=of.i_f,
        J_v=of.J_v,
        k_o=of.k,
        c_o=of.c,
        load=RoadLoad(constant=of.T_v),
        elements=elements,
    )


def state_of(of: Problem, given: Inputs) -> State:
    """The stated start."""
    engine, output, wheel, torque = start(of, given)
    return State(engine, output, wheel, torque / of.k, _CLUTCHES[:1])


def signals_of(given: Inputs) -> dict[str, Signal]:
    """Engine torque and pressures by name."""
    columns = zip((ENGINE_TORQUE, *_CLUTCHES), (given.torque, *given.pressures), strict=True)
    return {name: Signal(given.time, values) for name, values in columns}


def scenario_of(of: Problem, given: Inputs) -> Scenario:
    """The same for the network."""
    return Scenario(
        network_of(model_of(of)),
        signals_of(given),
        network_start(state_of(of, given)),
        given.time,
        OUTPUTS,
    )


def entries(of: Problem, given: Inputs, reference: Judge, example: Example) -> list[Entry]:
    """Four outputs on the 1 ms grid, with default settings."""
    path = example.store("shift", scenario_of(of, given))
    model, signals, begin = model_of(of), signals_of(given), state_of(of, given)
    torque = signals.pop(ENGINE_TORQUE)

    def simulated() -> Trajectory:
        return simulate(model, torque, signals, begin, given.time)

    def derived() -> Sensitivities:
        return sensitivities(model, torque, signals, begin, given.time, PARAMETERS)

    return [
        Entry(PROGRAM, READY, lambda: example.run(path, _REPEATS, "again"), reference),
        Entry(PROGRAM, FIRST, lambda: example.run(path, _REPEATS, "first"), reference),
        Entry(
            PROGRAM,
            WHOLE,
            lambda: example.run(path, _REPEATS, "whole"),
            reference,
        ),
        Entry(
            PROGRAM,
            PYTHON,
            lambda: timed(lambda: _solution(simulated()), _REPEATS),
            reference,
        ),
        Entry(
            PROGRAM,
            DERIVED,
            lambda: timed(lambda: _solution(derived().run), _REPEATS),
            reference,
            Group.DERIVATIVES,
        ),
    ]


def _solution(run: Trajectory) -> Solution:
    columns = (run.engine_speed, run.output_speed, run.wheel_speed, run.shaft_torque)
    return Solution(np.array(columns), np.array([event.time for event in run.events]))
