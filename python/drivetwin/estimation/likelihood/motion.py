# SPDX-License-Identifier: MIT
"""Motion of a dual clutch in a simulated shift: its trajectory, slip and friction torques."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import InputError, SimulationError
from drivetwin.estimation.likelihood.parametrization import DualClutchTerm
from drivetwin.likelihood.point import ParameterVector
from drivetwin.simulation.driveline_run import build_trajectory, list_motion_outputs
from drivetwin.simulation.dual_clutch import Trajectory

SLIPPING = 1e-6
"""Slip [rad/s] above which a simulated element is not locked."""


def simulate_motion(term: DualClutchTerm, point: ParameterVector) -> Trajectory | None:
    """Simulate the motion at `point`; None if the simulation fails or does not reach the end."""
    names = [one.name for one in term.plant.build_model(point).elements]
    try:
        run = replace(term.build_task(point), outputs=list_motion_outputs(names)).simulate()
    except (InputError, SimulationError):
        return None
    return build_trajectory(run, names) if run.status == "completed" else None


@dataclass(frozen=True, eq=False)
class Contact:
    """One element in one term, over the steps (N-1,) of a run with their `middle` [s].

    `slip` [rad/s], pressure `above` P0 [Pa], `friction` of its law, and the torque `per_mu` [N m]
    that friction of 1 makes, with the sign of slip, 0 where the element is locked. Of an element
    that the term does not have all are 0.
    """

    middle: FloatArray
    slip: FloatArray
    above: FloatArray
    friction: FloatArray
    per_mu: FloatArray


def evaluate_contact(
    term: DualClutchTerm, point: ParameterVector, run: Trajectory, name: str
) -> Contact:
    """Evaluate element `name` along `run`, the simulation of the term at `point`."""
    middle = 0.5 * (run.time[1:] + run.time[:-1])
    model = term.plant.build_model(point)
    one = next((e for e in model.elements if e.name == name), None)
    if one is None or name not in term.record.pressures:
        nothing = np.zeros(middle.size)
        return Contact(middle, nothing, nothing, nothing, nothing)
    slips = run.slip[name]
    slip = 0.5 * (slips[1:] + slips[:-1])
    signal = term.record.pressures[name]
    above = np.maximum(np.interp(middle, signal.time, signal.values) - one.P0, 0.0)
    slipping = np.minimum(np.abs(slips[1:]), np.abs(slips[:-1])) > SLIPPING
    per_mu = np.where(slipping, np.sign(slip) * one.gain * above, 0.0)
    return Contact(middle, slip, above, one.friction.evaluate(slip), per_mu)


def find_loaded_slips(term: DualClutchTerm, point: ParameterVector, name: str) -> FloatArray:
    """Sizes of the slip (n,) [rad/s] over the steps in which element `name` slips under pressure.

    Empty where the term does not have it. `point` is one that can be simulated.
    """
    run = simulate_motion(term, point)
    assert run is not None, "a fit can be simulated"
    contact = evaluate_contact(term, point, run, name)
    return np.asarray(np.abs(contact.slip[contact.per_mu != 0.0]))
