# SPDX-License-Identifier: MIT
"""Peak jerk that no profile can fall below on the nominal driveline.

Friction torques stand in place of pressures: any that the sign of the slip allows, and any while an
element sticks. With the instants of break-away and lock-up given, a shift is linear in torques and
state, and its least peak jerk is a linear program; the instants are searched. Limits of friction
energy, vibration dose and pressures are left out, so that the optimum bounds every policy from
below. It is that of one driveline, to which a profile could be fitted: made units leave a gap.

Source: J. Betts, Practical Methods for Optimal Control (2010), section 4.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import expm
from scipy.optimize import linprog
from scipy.sparse import csr_array, eye_array, hstack, kron, vstack

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.maneuver import Maneuver
from drivetwin.calibration.metrics import Metric
from drivetwin.calibration.objective import Limit

_STEP = 0.01
"""Step of the program [s], a usual task of a controller; torques are straight lines in between."""
_LOCKS, _SLIPS = np.linspace(1.0, 0.5, 3), np.linspace(0.0, 0.8, 9)
"""Instants of lock-up over the limit of the shift time, and of break-away over that of lock-up."""
_ENGINE, _OFF, _ON = 4, 5, 6
"""Places of the torques among the numbers of a step: speeds of engine, output and wheel [rad/s],
spring torque of the shaft, torques of engine, off-going and on-coming element [N m]."""


def compute_lower_bound(maneuver: Maneuver, limits: Sequence[Limit]) -> float | None:
    """Compute the peak jerk [m/s^3] below which no profile comes on the nominal driveline.

    Parameters
    ----------
    maneuver
        The shift; elements beside its dual clutch are left out.
    limits
        Limits; those of shift time, torque intervention and torque rate take part.

    Returns
    -------
    float or None
        The bound; None where no relaxed shift keeps the limits.
    """
    bounds = {one.metric: one.bound for one in limits}
    time = maneuver.horizon - maneuver.request
    last = min(bounds.get(Metric.SHIFT_TIME, time), time)
    locks = dict.fromkeys(round(last * share / _STEP) for share in _LOCKS)
    places = dict.fromkeys((round(lock * share), lock) for lock in locks for share in _SLIPS)
    steps = np.arange(round(time / _STEP) + 1)
    found = [_solve(maneuver, steps <= slip, steps >= lock, bounds) for slip, lock in places]
    return min((one for one in found if one is not None), default=None)


def _solve(
    maneuver: Maneuver,
    before: NDArray[np.bool_],
    after: NDArray[np.bool_],
    bounds: Mapping[Metric, float],
) -> float | None:
    """Solve the program with the steps (n,) before break-away and after lock-up."""
    motion, constant, slip, jerk = _describe_motion(maneuver)
    count, side = before.size, -maneuver.direction
    every = eye_array(count, format="csr")
    here, there = every[:-1], every[1:]
    stuck = [kron(every[chosen], slip[[k]]) for k, chosen in enumerate((before, after))]
    equal = vstack([kron(here, motion[:, :7]) + kron(there, motion[:, 7:]), *stuck])
    goal = np.append(np.tile(constant, count - 1), np.zeros(equal.shape[0] - 4 * (count - 1)))
    change = kron(there - here, np.stack([jerk, np.eye(7)[_ENGINE] / _STEP]))
    rows = vstack([change, -change, kron(every, np.diag([side, -side]) @ slip)])
    highest = np.zeros((rows.shape[0], 2))
    highest[: 4 * (count - 1)] = np.tile(
        [[0.0, -1.0], [bounds.get(Metric.TORQUE_RATE, 1e9), 0.0]], (2 * (count - 1), 1)
    )
    free = np.tile([-np.inf, np.inf], (count, 7, 1))
    demand, start = maneuver.point.engine_torque, maneuver.build_start()
    depth = bounds.get(Metric.TORQUE_REDUCTION, np.inf)
    free[:, _ENGINE] = sorted([demand, demand + maneuver.direction * depth])
    free[[0, -1], _ENGINE] = demand
    speeds = start.engine_speed, start.output_speed, start.wheel_speed
    free[0, :4] = np.array([*speeds, maneuver.model.k_o * start.twist])[:, None]
    for place, sign, slips in ((_OFF, -side, ~before), (_ON, side, ~after)):
        free[slips, place, int(sign < 0.0)] = 0.0
    # Any: the types of `linprog` lack the sparse arrays that it takes.
    matrices: Any = (
        hstack([rows, csr_array(highest[:, 1:])]),
        hstack([equal, csr_array((equal.shape[0], 1))]),
    )
    box: Any = np.append(free.reshape(-1, 2), [[0.0, np.inf]], axis=0)
    cost = np.eye(1, 7 * count + 1, 7 * count)[0]
    solved = linprog(cost, matrices[0], highest[:, 0], matrices[1], goal, box)
    return None if solved.fun is None else float(solved.fun)


def _describe_motion(
    maneuver: Maneuver,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return a step as rows (4, 14) over the numbers at its begin and end, with their values (4,).

    Further the slips (2, 7) of both elements, and the factors (7,) of the numbers whose change over
    a step is the mean jerk in it.
    """
    model, (old, new) = maneuver.model, maneuver.model.elements
    load = model.load.evaluate(maneuver.build_start().wheel_speed)
    eta = model.get_efficiency(driving=maneuver.point.engine_torque > 0.0)
    slip = np.zeros((2, 7))
    slip[:, 0] = [1.0 / (model.i_in * one.i_c) for one in (old, new)]
    slip[:, 1] = [-old.i_out, -new.i_out]
    shaft = np.array([0.0, model.c_o, -model.c_o * model.i_f, 1.0, 0.0, 0.0, 0.0])
    # Rates of the seven numbers, of 1, and of the changes of the three torques in the step.
    rates = np.zeros((11, 11))
    rates[0, 4:7] = np.array([eta, *-slip[:, 0]]) / (model.J1 * eta + model.J2e)
    rates[1, :7] = (np.array([0, 0, 0, 0, 0, old.i_out, new.i_out]) - shaft) / model.J_out
    rates[2, :8] = np.append(model.i_f * shaft, -load) / model.J_v
    rates[3, 1:3] = model.k_o, -model.k_o * model.i_f
    rates[4:7, 8:] = np.eye(3) / _STEP
    step = expm(rates * _STEP)[:4]
    motion = np.hstack([step[:, :4], step[:, 4:7] - step[:, 8:], -np.eye(4), step[:, 8:]])
    return motion, -step[:, 7], slip, maneuver.wheel_radius * model.i_f / model.J_v / _STEP * shaft
