# SPDX-License-Identifier: MIT
"""Monte Carlo of a problem: minima, errors over bounds, coverage and CPU time of `Model.fit`."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.fit.problem import (
    LONGEST,
    Problem,
    Realisation,
    Values,
    compute_prior_std,
    move_fixed,
    read_channels,
    record,
)
from benchmarks.fit.problems import build_problem
from benchmarks.rows import append_row, read_rows
from drivetwin.errors import DrivetwinError
from drivetwin.fit.fixed_numbers import Source, Tolerance
from drivetwin.fit.recording import Measured, Recording
from drivetwin.fit.result import ModelFit
from drivetwin.fit.unknown import Unknown
from drivetwin.likelihood.recorded_data import hold_ends

CLOSE = 10.0
"""Cost above that of the minimum at the truth up to which a minimum counts as the right one."""
HALF = 1.96
"""Half width of a 95 % interval, in standard deviations."""


@dataclass(frozen=True)
class Found:
    """Estimates of one fit: value and total standard deviation by unknown; cost and verdicts."""

    values: Mapping[str, float]
    std: Mapping[str, float]
    cost: float
    starts: tuple[float, ...] = ()
    verdicts: Mapping[str, str] = field(default_factory=dict)
    status: str = ""


@dataclass(frozen=True)
class Try:
    """Outcome of one realisation.

    `errors` and `std` are in the scale of the search: the logarithm, or relative to the truth.
    `excess` is the cost above that of the fit that starts at the truth. `reached` counts the
    starts within CLOSE of the best one.
    """

    seed: int
    errors: Mapping[str, float]
    std: Mapping[str, float]
    excess: float
    reached: tuple[int, int]
    seconds: float
    failure: str = ""
    verdicts: Mapping[str, str] = field(default_factory=dict)
    status: str = ""

    @property
    def is_right(self) -> bool:
        """True if the fit ended in the right minimum or in a better one."""
        return not self.failure and self.excess <= CLOSE


def run_study(
    name: str,
    seeds: Sequence[int],
    workers: int = 1,
    *,
    sigmas_known: bool = True,
    mismatch: bool = False,
    rate: float | None = None,
    rows: Path | None = None,
) -> list[Try]:
    """Fit the realisations of `seeds` of a problem; the result is independent of `workers`.

    Parameters
    ----------
    name
        Name of the problem.
    seeds
        One per realisation.
    workers
        Number of processes.
    sigmas_known
        Whether the fit is given the noise of the outputs; otherwise it estimates it.
    mismatch
        Whether the errors of all fixed numbers are drawn from their distributions.
    rate
        Rate of rough channels [Hz]; None for those of the problem.
    rows
        File of outcomes, to which new ones are appended; those in it are not computed again.

    Returns
    -------
    list of Try
        Outcomes in the order of the seeds.
    """
    kind = {"problem": name, "sigmas_known": sigmas_known, "mismatch": mismatch, "rate": rate}
    task = partial(fit_once, name, sigmas_known=sigmas_known, mismatch=mismatch, rate=rate)
    found = [Try(**one["outcome"]) for one in read_rows(rows) if one["kind"] == kind]
    done = {one.seed: one for one in found}
    with ProcessPoolExecutor(workers) as pool:
        missing = [seed for seed in seeds if seed not in done]
        for one in pool.map(task, missing):
            append_row(rows, {"kind": kind, "outcome": asdict(one)})
            done[one.seed] = one
    return [done[seed] for seed in seeds]


def fit_once(
    name: str,
    seed: int,
    *,
    sigmas_known: bool = True,
    mismatch: bool = False,
    rate: float | None = None,
) -> Try:
    """Draw the realisation of a seed, fit it, and fit it once more from the truth."""
    problem = build_problem(name, rate)
    drawn = draw(problem, seed, mismatch=mismatch)
    began = time.process_time()
    try:
        found = fit(problem, drawn, drawn.means, sigmas_known=sigmas_known)
    except DrivetwinError as error:
        seconds = time.process_time() - began
        return Try(seed, {}, {}, np.inf, (0, 0), seconds, str(error).partition("\n")[0])
    seconds = time.process_time() - began
    best = fit(problem, drawn, problem.truth, sigmas_known=sigmas_known)
    reference = best.cost + _price(problem, drawn.means, best.values)
    reference -= _price(problem, problem.truth, best.values)
    reached = sum(cost <= min(found.starts) + CLOSE for cost in found.starts)
    return Try(
        seed,
        {key: compute_error(problem, key, value) for key, value in found.values.items()},
        {key: scale_std(problem, key, found.values[key], std) for key, std in found.std.items()},
        found.cost - reference,
        (reached, len(found.starts)),
        seconds,
        verdicts=found.verdicts,
        status=found.status,
    )


def draw(problem: Problem, seed: int, *, mismatch: bool = False) -> Realisation:
    """Draw the realisation of a seed; other problems have other draws of the same seed."""
    rng = np.random.default_rng([seed, *problem.name.encode()])
    drawn = record(problem, rng)
    return replace(drawn, moves=rng.standard_normal(len(problem.fixed))) if mismatch else drawn


def fit(problem: Problem, drawn: Realisation, means: Values, *, sigmas_known: bool = True) -> Found:
    """Fit a realisation by `Model.fit` with priors about `means`, where the search starts.

    Parameters
    ----------
    problem
        Problem with its unknowns.
    drawn
        Recording with noise.
    means
        Prior means by unknown.
    sigmas_known
        Whether the noise of the outputs is stated.

    Returns
    -------
    Found
        Estimates and cost.
    """
    found = fit_model(problem, drawn, means, sigmas_known=sigmas_known)
    return Found(
        found.values,
        found.std,
        float(found.cost),
        tuple(float(one.cost) for one in found.starts),
        {name: str(found.estimates[name].verdict) for name in problem.unknowns},
        str(found.status),
    )


def fit_model(
    problem: Problem, drawn: Realisation, means: Values, *, sigmas_known: bool = True
) -> ModelFit:
    """Fit a realisation as `fit` does, and return the result itself."""
    start = drawn.start if means is drawn.means else {**drawn.start, **_get_twists(problem, means)}
    model = problem.build(means, drawn.inputs, start)
    outputs = {
        name: Measured(problem.time, values, problem.outputs[name].sigma if sigmas_known else None)
        for name, values in drawn.outputs.items()
    }
    known = {node: drawn.start[node] for node in sorted(problem.known)}
    unknowns = {
        name: Unknown(means[name], compute_prior_std(problem, name, means[name]), paths=one.paths)
        for name, one in problem.unknowns.items()
    }
    wanted = {name: one.output for name, one in problem.outputs.items()}
    tolerances = {}
    moves = drawn.moves
    if moves is None:
        tolerances = {one.name: Tolerance(exact=True) for one in model.components}
        tolerances["gain"] = Tolerance(exact=True)
    else:
        tolerances = {  # a moved number has other digits than the one that somebody wrote
            one.name: Tolerance(one.std) for one in problem.fixed if one.source is Source.DIGITS
        }
        drawn = read_channels(problem, drawn)
        move_fixed(problem, model, moves)
    inputs = {
        name: hold_ends(one, LONGEST) if name in problem.delays else one
        for name, one in drawn.inputs.items()
    }
    recording = Recording(inputs, outputs, known)
    return model.fit([recording], unknowns, wanted, tolerances=tolerances, seed=0)


def _get_twists(problem: Problem, means: Values) -> dict[str, float]:
    """Return the start values that are no measured speeds, as they belong to unknown values."""
    nodes = [one.output[1] for one in problem.outputs.values() if one.output[0] == "speed"]
    return {name: value for name, value in problem.start(means).items() if name not in nodes}


def compute_error(problem: Problem, name: str, value: float) -> float:
    """Return the error of an estimate in the scale of the search."""
    truth = problem.unknowns[name].truth
    if name in problem.logarithmic:
        return float(np.log(value / truth)) if value / truth > 0.0 else -np.inf
    return value / truth - 1.0


def scale_std(problem: Problem, name: str, value: float, std: float) -> float:
    """Return a standard deviation in the scale of the search."""
    return std / abs(value if name in problem.logarithmic else problem.unknowns[name].truth)


def _price(problem: Problem, means: Values, values: Values) -> float:
    """Return the cost of the priors about `means` at `values`."""
    return sum(
        ((compute_error(problem, name, value) - compute_error(problem, name, means[name])) / std)
        ** 2
        for name, value in values.items()
        for std in [problem.unknowns[name].spread]
    )


def list_tables(
    problem: str, tries: Sequence[Try], bounds: Mapping[str, float]
) -> dict[str, list[dict[str, Any]]]:
    """List the raw results of a problem: one row for each try, and one for each of its values.

    Parameters
    ----------
    problem, tries
        Name of the problem and its outcomes.
    bounds
        Cramér-Rao bound by unknown, in the scale of the search; empty where none is compared.
    """
    logs = [
        {
            "seed": one.seed,
            "kind": problem,
            "detail": "" if one.is_right else "wrong minimum",
            "status": one.status or "failed",
            "right": one.is_right,
            "seconds": one.seconds,
            "failure": one.failure,
        }
        for one in tries
    ]
    values = [
        {
            "seed": one.seed,
            "kind": problem,
            "name": name,
            "sort": one.verdicts[name],
            "apart": error / one.std[name],
            "ratio": error / bounds[name] if one.is_right and name in bounds else None,
        }
        for one in tries
        for name, error in one.errors.items()
    ]
    return {"logs": logs, "values": values}
