# SPDX-License-Identifier: MIT
"""Numba: fixed steps and friction smoothed by a hyperbolic tangent, as is often done."""

from __future__ import annotations

import math

import numpy as np

from benchmarks.speed.measure import Entry, Judge, Skipped, timed
from benchmarks.speed.statement import SAMPLES, STEP, Inputs, Problem, Solution, start
from drivetwin.driveline import FloatArray

_SETTINGS = ((0.3, 25, 10), (0.1, 100, 5), (0.01, 500, 1))
"""Width of the smoothing [rad/s], steps per sample, runs per round."""


def entries(of: Problem, given: Inputs, judge: Judge) -> list[Entry] | Skipped:
    """Three widths of the smoothing, each with the longest steps that stay stable."""
    try:
        import numba
    except ImportError:
        return Skipped("Numba", "numba is not installed (group `bench`)")
    simulate = numba.njit(fastmath=True)(_simulate)
    inputs = np.column_stack([given.torque, *given.pressures])
    numbers = np.array(
        [
            *(of.J_e, of.J_out, of.J_v, of.eta, of.i_f, of.T_v, of.k, of.c),
            *(1.0 / of.i_in / of.i_c[0], of.i_out[0], 1.0 / of.i_in / of.i_c[1], of.i_out[1]),
            *(*of.gain, of.P0[0], of.mu_s, of.mu_c, of.v_s, of.mu_v),
        ]
    )
    first = np.array(start(of, given))

    def entry(width: float, substeps: int, repeats: int) -> Entry:
        columns = np.zeros((4, SAMPLES))

        def run() -> Solution:
            simulate(numbers, first, inputs, substeps, width, columns)
            return Solution(columns, np.zeros(0))

        run()  # the first call compiles
        setting = f"RK4, {1e3 / substeps:g} us, tanh over {width:g} rad/s"
        return Entry("Numba", setting, lambda: timed(run, repeats), judge, rounds=5)

    return [entry(*setting) for setting in _SETTINGS]


def _simulate(
    p: FloatArray,
    first: FloatArray,
    inputs: FloatArray,
    substeps: int,
    width: float,
    columns: FloatArray,
) -> None:
    """All in one function, which is what the compiler takes best."""
    h = STEP / substeps
    x, k, z, total = first.copy(), np.zeros(4), np.zeros(4), np.zeros(4)
    for n in range(inputs.shape[0]):
        for i in range(3):
            columns[i, n] = x[i]
        columns[3, n] = x[3] + p[7] * (x[1] - p[4] * x[2])
        if n == inputs.shape[0] - 1:
            break
        for q in range(substeps):
            total[:] = 0.0
            z[:] = x
            for stage in range(4):
                part = (q + (0.0, 0.5, 0.5, 1.0)[stage]) / substeps
                torque = inputs[n, 0] + part * (inputs[n + 1, 0] - inputs[n, 0])
                shaft = z[3] + p[7] * (z[1] - p[4] * z[2])
                engine, output = p[3] * torque, -shaft
                for j in range(2):
                    a, b = p[8 + 2 * j], p[9 + 2 * j]
                    slip = a * z[0] - b * z[1]
                    pressure = inputs[n, 1 + j] + part * (inputs[n + 1, 1 + j] - inputs[n, 1 + j])
                    size = abs(slip)
                    mu = p[16] + (p[15] - p[16]) * math.exp(-size / p[17]) + p[18] * size
                    grip = p[12 + j] * max(0.0, pressure - p[14])
                    friction = math.tanh(slip / width) * mu * grip
                    engine -= a * friction
                    output += b * friction
                k[0], k[1] = engine / p[0], output / p[1]
                k[2] = (shaft * p[4] - p[5]) / p[2]
                k[3] = p[6] * (z[1] - p[4] * z[2])
                weight = (1.0, 2.0, 2.0, 1.0)[stage]
                reach = (0.5, 0.5, 1.0, 0.0)[stage]
                for i in range(4):
                    total[i] += weight * k[i]
                    z[i] = x[i] + reach * h * k[i]
            for i in range(4):
                x[i] += h / 6.0 * total[i]
