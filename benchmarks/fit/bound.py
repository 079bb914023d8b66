# SPDX-License-Identifier: MIT
"""Cramér-Rao bound of a problem, with priors, unknown start values and noise of the inputs.

The derivatives are exact ones at the truth. The response of the outputs to the noise of the inputs
comes from disturbed runs: the noise of BLOCK samples is replaced by their mean, which acts on
speeds and torques as they do. Nothing of the fit is used.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from benchmarks.fit.problem import Problem
from drivetwin._util.arrays import FloatArray
from drivetwin.simulation.dual_clutch import Signal

BLOCK = 2e-3
"""Time over which the noise of an input is one mean [s]."""
SILENT = 1e-9
"""Response over the noise of a sensor below which a block of an input does not act."""


@dataclass(frozen=True, eq=False)
class Bound:
    """Bound by unknown as standard deviation in the scale of the search, and the full covariance.

    The scale is the logarithm, or the value over the truth where an unknown is sought linearly.
    """

    std: dict[str, float]
    names: tuple[str, ...]
    covariance: FloatArray


def compute_bound(problem: Problem) -> Bound:
    """Compute the Cramér-Rao bound at the truth.

    Parameters
    ----------
    problem
        Problem with its truth, noise and priors.

    Returns
    -------
    Bound
        Standard deviations of the unknowns; the start values are nuisances.
    """
    names = (*problem.unknowns, *(f"start.{one}" for one in problem.open_start))
    slopes = compute_slopes(problem)
    whitened = slopes.reshape(-1, len(names))
    noise = compute_input_response(problem)
    information = whitened.T @ whitened
    if noise.size:
        inner = np.eye(noise.shape[1]) + noise.T @ noise
        through = noise.T @ whitened
        information -= through.T @ np.linalg.solve(inner, through)
    for place, one in enumerate(problem.unknowns.values()):
        information[place, place] += 1.0 / one.spread**2
    scale = np.sqrt(np.diag(information))
    covariance = np.linalg.inv(information / np.outer(scale, scale)) / np.outer(scale, scale)
    std = np.sqrt(np.diag(covariance))
    return Bound(dict(zip(problem.unknowns, std.tolist(), strict=False)), names, covariance)


def compute_slopes(problem: Problem) -> FloatArray:
    """Compute the derivatives (m, n, p) of the outputs over their noise at the truth.

    The first unknowns are those of the problem, by the logarithm or relative to the truth; then
    come the unknown start values [rad/s, rad].
    """
    unknowns: dict[str, dict[str, float]] = {
        name: dict.fromkeys(one.paths, one.truth) for name, one in problem.unknowns.items()
    }
    unknowns |= {f"start.{one}": {f"start.{one}": 1.0} for one in problem.open_start}
    found = problem.build().differentiate(problem.time, unknowns, record=problem.records)
    if found.run.status != "completed":
        raise RuntimeError(f"derivatives of {problem.name}: {found.run.status}")
    columns = np.array([found.derivatives[one] for one in problem.records])
    return np.asarray(columns / problem.sigmas[:, None, None])


def compute_input_response(problem: Problem) -> FloatArray:
    """Compute the response (m·n, b) of the outputs over their noise to the noise of the inputs."""
    base = problem.simulate()
    assert base is not None
    columns = []
    for name, block, size in _list_blocks(problem):
        source = problem.inputs[name]
        values = source.signal.values.copy()
        values[block] += size
        changed = problem.simulate(inputs={name: Signal(source.signal.time, values)})
        assert changed is not None
        response = ((changed - base) / problem.sigmas[:, None]).ravel()
        if np.max(np.abs(response)) > SILENT:
            columns.append(response)
    return np.column_stack(columns) if columns else np.zeros((base.size, 0))


def _list_blocks(problem: Problem) -> Iterator[tuple[str, slice, float]]:
    """List input, samples and size of each disturbance: the standard deviation of their mean."""
    for name, source in problem.inputs.items():
        if source.sigma <= 0.0:
            continue
        time = source.signal.time
        width = max(round(BLOCK / float(time[1] - time[0])), 1)
        for first in range(0, time.size, width):
            block = slice(first, min(first + width, time.size))
            yield name, block, source.sigma / float(np.sqrt(block.stop - block.start))


def format_bound(problem: Problem, bound: Bound) -> str:
    """Return a table of bounds: true value, bound in %, bound over prior."""
    lines = [
        f"{problem.name}: {len(problem.unknowns)} unknowns, {len(problem.open_start)} unknown "
        f"start values, {problem.time.size} samples of {len(problem.outputs)} outputs"
    ]
    for name, std in bound.std.items():
        one = problem.unknowns[name]
        lines.append(
            f"  {name:10} {one.truth:10.4g}  bound {100 * std:7.3f} %  "
            f"prior {100 * one.spread:4.0f} %  ratio {std / one.spread:.3f}"
        )
    return "\n".join(lines)
