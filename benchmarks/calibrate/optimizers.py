# SPDX-License-Identifier: MIT
"""Optimisers that are compared, from one start: the product's, CMA-ES alone, L-BFGS, Optuna."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib import import_module

import numpy as np
from scipy.optimize import minimize

from drivetwin._util.arrays import FloatArray
from drivetwin.calibration.calibrate import (
    Assessment,
    Task,
    assess,
    build_objective,
    draw_for,
    find_best,
    make_quick_plant,
)
from drivetwin.calibration.evaluate import Plant
from drivetwin.calibration.metrics import Metric, Outcome
from drivetwin.calibration.objective import Objective
from drivetwin.calibration.policy import Space
from drivetwin.calibration.scenarios import Purpose, Scenarios

Evaluate = Callable[[Sequence[FloatArray]], list[float]]
"""Objectives of candidates: coordinates (q,) from 0 to 1."""
_EDGE = 1e-3
"""Distance of a start from the bounds: CMA-ES has no room on them."""
_DRAWS = 64
"""Scenarios of the other optimisers."""
_EVALUATIONS = 4000
"""Candidates of each start of CMA-ES."""
_DIFFERENCE = 2e-5
"""Step of the differences of L-BFGS, in shares of the ranges."""
_POWER = 8
"""Power of the soft maximum over time and draws by L-BFGS, which needs a smooth objective."""


class OutOfTimeError(Exception):
    """The CPU time of an optimiser is used up."""


@dataclass
class Watch:
    """CPU time [s] that an optimiser has, and the best coordinates that it has found."""

    limit: float
    begin: float
    value: float = float("inf")
    best: FloatArray | None = None

    def note(self, value: float, coordinates: FloatArray) -> None:
        """Remember better coordinates. Raises OutOfTimeError after the limit."""
        if value < self.value:
            self.value, self.best = value, coordinates.copy()
        if self.elapsed > self.limit:
            raise OutOfTimeError

    @property
    def elapsed(self) -> float:
        """CPU time used [s]."""
        return time.process_time() - self.begin


@dataclass(frozen=True)
class Entry:
    """Result of an optimiser: CPU time [s], simulated shifts, and its best calibration."""

    name: str
    cpu: float
    runs: int
    found: Assessment


def run_product(task: Task, fresh: Scenarios, _: float) -> Entry:
    """Run search and polish of `drivetwin calibrate`."""
    begin, plant = time.process_time(), make_quick_plant(task)
    best = find_best(task, plant)
    return _finish("drivetwin calibrate", task, (begin, plant), (best, fresh))


def run_cma(task: Task, fresh: Scenarios, limit: float) -> Entry:
    """Run CMA-ES alone, one start after the other, on the draws of the polish."""
    cma = import_module("cma")

    def search(evaluate: Evaluate, start: FloatArray) -> None:
        seed = 100 * task.seed
        while True:
            seed += 1
            options = {"bounds": [0.0, 1.0], "seed": seed, "popsize": 24, "verbose": -9}
            one = cma.CMAEvolutionStrategy(np.clip(start, _EDGE, 1.0 - _EDGE), 0.12, options)
            while one.countevals < _EVALUATIONS and not one.stop():
                candidates = one.ask()
                one.tell(candidates, evaluate([np.asarray(each) for each in candidates]))

    return _run_within("CMA-ES alone", task, (make_quick_plant(task), fresh), limit, search)


def run_lbfgs(task: Task, fresh: Scenarios, limit: float) -> Entry:
    """Run L-BFGS on a soft maximum of jerk by differences, from random starts after the first."""
    space, plant = Space(task.policy), make_quick_plant(task)
    draws = draw_for(task, _DRAWS, Purpose.POLISH)
    objective = build_objective(task, plant)
    random = np.random.default_rng(task.seed)

    def search(evaluate: Evaluate, start: FloatArray) -> None:
        def smooth(candidates: Sequence[FloatArray]) -> list[float]:
            controls = [space.build_control(one) for one in candidates]
            return [_soften(objective, one) for one in plant.evaluate_all(controls, draws)]

        def slope(at: FloatArray) -> tuple[float, FloatArray]:
            evaluate([at])
            signs = np.where(at < 0.5, 1.0, -1.0)
            base, *moved = smooth([at, *(at + _DIFFERENCE * one for one in np.diag(signs))])
            return base, (np.array(moved) - base) / (_DIFFERENCE * signs)

        at = start
        while True:
            minimize(slope, at, jac=True, method="L-BFGS-B", bounds=[(0.0, 1.0)] * at.size)
            at = np.clip(start + 0.12 * random.standard_normal(start.size), 0.0, 1.0)

    return _run_within("L-BFGS", task, (plant, fresh), limit, search)


def run_optuna(task: Task, fresh: Scenarios, limit: float) -> Entry | None:
    """Run Optuna's tree-structured Parzen estimator; None where Optuna is not installed."""
    try:
        optuna = import_module("optuna")
    except ModuleNotFoundError:
        return None
    optuna.logging.set_verbosity(optuna.logging.ERROR)

    def search(evaluate: Evaluate, start: FloatArray) -> None:
        names = [f"x{k}" for k in range(start.size)]
        sampler = optuna.samplers.TPESampler(seed=task.seed, multivariate=True)
        study = optuna.create_study(sampler=sampler)
        study.enqueue_trial(dict(zip(names, start.tolist(), strict=True)))
        while True:
            trial = study.ask()
            at = np.array([trial.suggest_float(name, 0.0, 1.0) for name in names])
            study.tell(trial, evaluate([at])[0])

    return _run_within("Optuna, TPE", task, (make_quick_plant(task), fresh), limit, search)


def run_start(task: Task, fresh: Scenarios) -> Entry:
    """Assess the hand tuning."""
    plant = make_quick_plant(task)
    clock = time.process_time(), plant
    return _finish("hand tuning", task, clock, (Space(task.policy).start, fresh))


def _soften(objective: Objective, outcome: Outcome) -> float:
    size = np.minimum(np.abs(outcome.jerk), 1e3) / 50.0
    peak = 50.0 * (size**_POWER).sum(axis=1) ** (1.0 / _POWER)
    soft = float((peak**_POWER).mean() ** (1.0 / _POWER))
    excess = sum(float(np.maximum(one.measure(outcome), 0.0).mean()) for one in objective.limits)
    return soft + objective.weight * excess


def _run_within(
    name: str,
    task: Task,
    tried: tuple[Plant, Scenarios],
    limit: float,
    search: Callable[[Evaluate, FloatArray], None],
) -> Entry:
    """Run a search until its CPU time [s] is used up; `tried` are plant and fresh draws."""
    space, (plant, fresh) = Space(task.policy), tried
    watch = Watch(limit, time.process_time())
    draws = draw_for(task, _DRAWS, Purpose.POLISH)
    objective = build_objective(task, plant)

    def evaluate(candidates: Sequence[FloatArray]) -> list[float]:
        controls = [space.build_control(one) for one in candidates]
        values = [objective.evaluate(one) for one in plant.evaluate_all(controls, draws)]
        for value, coordinates in zip(values, candidates, strict=True):
            watch.note(value, coordinates)
        return values

    with suppress(OutOfTimeError):
        search(evaluate, space.start)
    best = space.start if watch.best is None else watch.best
    return _finish(name, task, (watch.begin, plant), (best, fresh))


def _finish(
    name: str, task: Task, clock: tuple[float, Plant], result: tuple[FloatArray, Scenarios]
) -> Entry:
    begin, plant = clock
    cpu, runs = time.process_time() - begin, plant.count.runs
    whole = replace(plant, metrics=tuple(Metric))
    return Entry(name, cpu, runs, assess(task, whole, *result))
