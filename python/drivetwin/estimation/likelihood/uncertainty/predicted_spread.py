# SPDX-License-Identifier: MIT
"""Spread of a simulation driven by measured inputs, as predicted from all known uncertainties.

A right model misses the measurement by sensor noise, by the noise of its inputs sent through the
driveline, and by the errors of its parameters and effects. The variance of each compared sample is
the sum of the three.
"""

from __future__ import annotations

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.estimation.likelihood.effects.correction import Correction
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.noise.residual_covariance import NoisePath
from drivetwin.estimation.likelihood.noise.shift_response import STATES, build_output_row
from drivetwin.estimation.likelihood.shift_objective import ShiftTerm
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.estimation.result.spread import PredictedSpread


def predict_spread(
    fit: LikelihoodFit, corrected: Correction
) -> tuple[dict[str, PredictedSpread], ...]:
    """Predict the distribution of measured less simulated signals, for each shift by signal.

    The simulation is that of the chosen plant with the corrected unknowns and none of the other
    effects; it is compared at the stamps of the samples, also where these are means over their
    period. A shift that cannot be simulated with them has no prediction.
    """
    found: list[dict[str, PredictedSpread]] = []
    joint = corrected.joint_covariance
    for part, slopes, z, residual in zip(
        fit.problem.parts,
        fit.normal.slopes,
        corrected.step.columns.matrices
        or [np.zeros((p.record.size, 0)) for p in fit.problem.parts],
        corrected.residuals,
        strict=True,
    ):
        run = part.simulate(corrected.mean)
        if run is None:
            found.append({})
            continue
        averaged = part.record.sample_run(run) - part.record.sample_stamps(run)
        mean = part.compute_residual(run) - residual + averaged
        rows = np.column_stack([slopes, z])
        variance = part.record.sigma**2 + np.einsum("np,pq,nq->n", rows, joint, rows)
        if part.weighting.path is not None:
            variance += _propagate_inputs(part, fit.point, part.weighting.path)
        found.append(_split(part, mean, np.sqrt(variance)))
    return tuple(found)


def _propagate_inputs(part: ShiftTerm, point: ParameterVector, path: NoisePath) -> FloatArray:
    """Compute the variance (n,) of the compared samples by the noise of the inputs."""
    response = path.response
    push = sum(
        path.power[name][:, None, None] * drive[:, :, None] * drive[:, None, :]
        for name, drive in response.drive.items()
    )
    state = np.zeros((part.record.time.size, STATES, STATES))
    for k, (step, change) in enumerate(zip(response.transition, np.asarray(push), strict=True)):
        state[k + 1] = step @ state[k] @ step.T + change
    model = part.structure.build_model(point)
    found = []
    for out in part.record.outputs:
        row = build_output_row(model, out.name)
        found.append(np.einsum("i,kij,j->k", row, state[out.centre], row))
    return np.concatenate(found)


def _split(part: ShiftTerm, mean: FloatArray, std: FloatArray) -> dict[str, PredictedSpread]:
    """Split stacked means and standard deviations (n,) by signal."""
    found, first = {}, 0
    for out in part.record.outputs:
        rows = slice(first, first + out.values.size)
        first = rows.stop
        name = "input_speed" if out.name == "engine_speed" else out.name
        found[name] = PredictedSpread(part.record.time[out.place], mean[rows], std[rows])
    return found
