# SPDX-License-Identifier: MIT
"""Linear response of a driveline with states that the dual clutch does not have.

The extended driveline has a part of an inertia cut off behind a compliance. The torque in the cut
of the rigid run drives it, so the response is the whole difference between both drivelines.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.effects.operating_point import OperatingPoint
from drivetwin.estimation.likelihood.noise.shift_response import (
    STATES,
    LinearRates,
    compute_exponentials,
    compute_rates,
    iterate_jumps,
)
from drivetwin.simulation.dual_clutch import DualClutch


@dataclass(frozen=True, eq=False)
class CutForce:
    """Torque that acts on one of the speeds in place of that of the rigid driveline.

    `speed` is the index of that speed, `row` (N-1, m) gives the torque in the cut from the m
    states, `gain` (N-1,) its action on the speed, `rigid` (N-1,) is the torque in the cut of the
    rigid run.
    """

    speed: int
    row: FloatArray
    gain: FloatArray
    rigid: FloatArray


@dataclass(frozen=True, eq=False)
class ExtendedRates:
    """Rates z' = matrix·z + drive of m states over each step: (N-1, m, m) and (N-1, m)."""

    matrix: FloatArray
    drive: FloatArray


def build_extended_rates(at: OperatingPoint, reduced: DualClutch, cut: CutForce) -> ExtendedRates:
    """Build the rates of the four states of the driveline; those of the others stay zero.

    `reduced` is the model without the inertia behind the cut.
    """
    rates: LinearRates = compute_rates(reduced, at.run, at.record)
    count, states = cut.row.shape
    matrix, drive = np.zeros((count, states, states)), np.zeros((count, states))
    matrix[:, :STATES, :STATES] = rates.rate
    along = rates.inverse[:, :, cut.speed] * cut.gain[:, None]
    matrix[:, :STATES, :] += along[:, :, None] * cut.row[:, None, :]
    drive[:, :STATES] = -along * cut.rigid[:, None]
    return ExtendedRates(matrix, drive)


def solve_extended(
    at: OperatingPoint, reduced: DualClutch, rates: ExtendedRates, start: FloatArray
) -> FloatArray:
    """Solve for the states of the driveline (N, 4) from the `start` (m,) of all states."""
    step = np.diff(at.run.time)
    with np.errstate(over="ignore", invalid="ignore"):
        transition, mean = compute_exponentials(rates.matrix * step[:, None, None])
    push = np.einsum("kij,kj->ki", mean, rates.drive * step[:, None])
    for k, jump in iterate_jumps(reduced, at.run):
        whole = np.eye(start.size)
        whole[:STATES, :STATES] = jump
        transition[k], push[k] = whole @ transition[k], whole @ push[k]
    return _propagate(transition, push, start)[:, :STATES]


def _propagate(transition: FloatArray, push: FloatArray, start: FloatArray) -> FloatArray:
    """Propagate z_{k+1} = transition_k·z_k + push_k; returns z (N, m)."""
    state = np.empty((len(transition) + 1, start.size))
    state[0] = start
    with np.errstate(over="ignore", invalid="ignore"):
        for k, (matrix, change) in enumerate(zip(transition, push, strict=True)):
            state[k + 1] = matrix @ state[k] + change
    return state
