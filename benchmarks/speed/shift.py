# SPDX-License-Identifier: MIT
"""The stated shift in drivetwin (in Rust, from Python, with derivatives) and in SciPy."""

from __future__ import annotations

import numpy as np

from benchmarks.speed.core import Example
from benchmarks.speed.measure import Entry, Group, Judge, Quality, time_runs
from drivetwin.simulation.driveline_run import list_motion_outputs, simulate
from drivetwin.simulation.dual_clutch import ENGINE_TORQUE, Trajectory
from drivetwin.simulation.network import NetworkRun
from drivetwin.simulation.network_sensitivity import differentiate
from tests.support.upshift.equations import Equations
from tests.support.upshift.scenario import (
    OUTPUTS,
    build_model,
    build_scenario,
    build_signals,
    build_state,
)
from tests.support.upshift.scipy_solution import Method, solve
from tests.support.upshift.statement import Inputs, Problem, Solution

PROGRAM = "drivetwin"
READY = "in Rust, network ready"
FIRST = "in Rust, first run of a network"
WHOLE = "in Rust, from the elements on"
PYTHON = "called from Python, nine columns"
_REPEATS = 20
PARAMETERS = (
    *("J1.inertia", "i_in.loss.eta", "J_out.inertia", "J_v.inertia"),
    *("output shaft.stiffness", "output shaft.damping", "i_f.ratio", "load.constant"),
    *("2.gain", "3.gain", "2.p0", "3.p0"),
    *(f"3.friction.{field}" for field in ("mu_c", "mu_s", "v_s", "mu_v")),
)
"""The sixteen that derivatives are taken for."""
DERIVED = f"{len(PARAMETERS)} parameters, called from Python"


def compare_with(reference: Solution) -> Judge:
    """Return a judge: largest errors of T_o, and of an event if all are found."""

    def compare(found: Solution) -> Quality:
        error = float(np.abs(found.columns[3] - reference.columns[3]).max())
        same = found.events.size == reference.events.size
        events = float(np.abs(found.events - reference.events).max()) if same else None
        return Quality(error, "N·m", events)

    return compare


def make_entries(of: Problem, given: Inputs, reference: Judge, example: Example) -> list[Entry]:
    """Return the entries: four outputs on the 1 ms grid, with default settings."""
    shift = build_scenario(of, given)
    path = example.store("shift", shift)
    model, signals, begin = build_model(of), build_signals(given), build_state(of, given)
    torque = signals.pop(ENGINE_TORQUE)
    columns = list_motion_outputs([one.name for one in model.elements])

    def simulate_once() -> Trajectory:
        return simulate(model, torque, signals, begin, given.time)

    def derive_once() -> Solution:
        run = (shift.elements, shift.inputs, shift.start, shift.time, columns)
        return _collect(differentiate(*run, PARAMETERS).run)

    return [
        Entry(PROGRAM, READY, lambda: example.run(path, _REPEATS, "again"), reference),
        Entry(PROGRAM, FIRST, lambda: example.run(path, _REPEATS, "first"), reference),
        Entry(PROGRAM, WHOLE, lambda: example.run(path, _REPEATS, "whole"), reference),
        Entry(
            PROGRAM,
            PYTHON,
            lambda: time_runs(lambda: _convert(simulate_once()), _REPEATS),
            reference,
        ),
        Entry(
            PROGRAM,
            DERIVED,
            lambda: time_runs(derive_once, _REPEATS),
            reference,
            Group.DERIVATIVES,
        ),
    ]


def _convert(run: Trajectory) -> Solution:
    columns = (run.engine_speed, run.output_speed, run.wheel_speed, run.shaft_torque)
    return Solution(np.array(columns), np.array([event.time for event in run.events]))


def _collect(run: NetworkRun) -> Solution:
    columns = np.array([run.columns[output] for output in OUTPUTS])
    return Solution(columns, np.array([event.time for event in run.events]))


def make_scipy_entries(of: Problem, given: Inputs, judge: Judge) -> list[Entry]:
    """Return RK45 and LSODA at a loose and a usual tolerance."""
    equations = Equations(of, given)

    def make_entry(method: Method, rtol: float, atol: float, max_step: float) -> Entry:
        def run() -> Solution:
            return solve(equations, given.time, method, (rtol, atol, max_step))

        setting = f"{method}, rtol {rtol:g}, restart at events"
        return Entry("SciPy", setting, lambda: time_runs(run, 1), judge, rounds=3)

    return [
        make_entry("RK45", 1e-3, 1e-6, np.inf),
        make_entry("RK45", 1e-6, 1e-8, 1e-2),
        make_entry("LSODA", 1e-3, 1e-6, np.inf),
        make_entry("LSODA", 1e-6, 1e-8, 1e-2),
    ]
