# SPDX-License-Identifier: MIT
"""Monte Carlo of one scenario: errors and stated deviations of each method, and the bound."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from benchmarks.estimation.bench import Bench, Knowledge, realise
from benchmarks.estimation.bound import bound
from drivetwin.driveline import Stribeck
from drivetwin.dyno.scenario import Scenario
from drivetwin.errors import IdentificationError
from drivetwin.identify.friction import stribeck
from drivetwin.identify.integral import IntegralShift, identify_shift
from drivetwin.identify.likelihood.derived import parameters, slopes
from drivetwin.identify.likelihood.fit import LikelihoodFit
from drivetwin.identify.likelihood.guess import guess_of
from drivetwin.identify.likelihood.priors import problem_of
from drivetwin.identify.likelihood.problem import Problem
from drivetwin.identify.likelihood.unknowns import LAW
from drivetwin.identify.likelihood.variants import choose
from drivetwin.identify.optimize.objective import Point
from drivetwin.identify.signals import FloatArray
from drivetwin.vehicle.spec import PriorValue

SLIPS = (10.0, 30.0, 50.0)
"""Slips [rad/s] at which the friction coefficient is compared."""
START_INERTIA = 10.0


@dataclass(frozen=True)
class Sample:
    """Error and stated standard deviation of one parameter in one realisation."""

    error: float
    std: float


@dataclass(frozen=True)
class Study:
    """`samples[method][parameter]` of `count` realisations, the truth and the bound by parameter,
    failures by method."""

    name: str
    count: int
    truth: Mapping[str, float]
    bounds: Mapping[str, float]
    samples: Mapping[str, Mapping[str, list[Sample]]]
    failures: Mapping[str, int]


def run_study(scenario: Scenario, know: Knowledge, seeds: Sequence[int]) -> Study:
    """Fit the noise realisations of `seeds` by the linear and the likelihood method."""
    truth = truth_of(realise(scenario, 0, know, noise=0.0))
    samples: dict[str, dict[str, list[Sample]]] = {"integral": {}, "likelihood": {}}
    failures = dict.fromkeys(samples, 0)
    with ProcessPoolExecutor() as pool:
        for linear, best in pool.map(partial(_fits, scenario, know), seeds):
            _collect(samples["integral"], truth, linear)
            if best is None:
                failures["likelihood"] += 1
            else:
                _collect(samples["likelihood"], truth, best)
    return Study(scenario.name, len(seeds), truth, bounds_of(scenario, know), samples, failures)


_Told = dict[str, tuple[float, float]]


def _fits(scenario: Scenario, know: Knowledge, seed: int) -> tuple[_Told, _Told | None]:
    """What both methods tell of one realisation; None where the likelihood gives up."""
    bench = realise(scenario, seed, know)
    linear = identify_shift(bench.signals, bench.driveline, START_INERTIA)
    try:
        best = told(best_fit(bench, linear), bench)
    except IdentificationError:
        best = None
    return _told_linearly(linear), best


def best_fit(bench: Bench, linear: IntegralShift) -> LikelihoodFit:
    """The likelihood fit, started from the linear one, as the program makes it."""
    law = bench.run.scenario.model.loss_law
    guess = guess_of([linear], [bench.driveline])
    return choose([bench.signals], [bench.driveline], law, guess)[0]


def truth_of(bench: Bench) -> dict[str, float]:
    """Truth by id, with μ at the compared slips."""
    name = bench.run.scenario.oncoming
    law = bench.run.truth.friction[name]
    mu = law.at(np.array(SLIPS))
    return {**bench.truth, **{_mu(s): float(m) for s, m in zip(SLIPS, mu, strict=True)}}


def told(fit: LikelihoodFit, bench: Bench) -> dict[str, tuple[float, float]]:
    """Value and standard deviation of every parameter of a fit."""
    return _with_std(fit.problem, fit.mean, fit.covariance, bench)


def bounds_of(scenario: Scenario, know: Knowledge) -> dict[str, float]:
    """Cramér-Rao bound of every parameter, as a standard deviation."""
    clean = realise(scenario, 0, Knowledge(), noise=0.0)
    couplings = {
        n: replace(c, P0=PriorValue(c.P0.value, know.P0), drum=PriorValue(c.drum.value, know.drum))
        for n, c in clean.driveline.couplings.items()
    }
    J_out = scenario.model.J_out
    driveline = replace(
        clean.driveline,
        offgoing=couplings[scenario.offgoing],
        oncoming=couplings[scenario.oncoming],
        couplings=couplings,
        J_out=PriorValue(J_out, know.J_out * J_out),
    )
    bench = replace(clean, driveline=driveline)
    law = scenario.model.loss_law
    problem, start = problem_of([bench.signals], [driveline], law, guess_from_truth(bench))
    truth = at_truth(problem, start, bench)
    covariance = bound(bench, problem.parts[0], truth, problem.prior)
    found = _with_std(problem, truth, covariance, bench)
    return {name: std for name, (_, std) in found.items()}


def guess_from_truth(bench: Bench) -> dict[str, float]:
    """The truth by unknown of the fit."""
    model = bench.run.scenario.model
    values = {
        "eta": model.eta,
        "J_e": model.J1 * model.eta + model.J2e,
        "J_out": model.J_out,
        "J_vehicle": model.J_v,
        "Tv_over_if": bench.truth["Tv_over_if"],
        "k_o": model.k_o,
        "c_o": model.c_o,
        "te_delay": bench.truth["te_delay"],
    }
    for one in model.elements:
        law = one.friction
        assert isinstance(law, Stribeck)
        coefficients = (law.mu_c, law.mu_s - law.mu_c, law.mu_v, float(np.log(law.v_s)))
        values |= {f"{one.name}.{k}": v for k, v in zip(LAW, coefficients, strict=True)}
        values |= {f"{one.name}.P0": one.P0, f"{one.name}.drum": one.drum_inertia}
    return values


def at_truth(problem: Problem, start: Point, bench: Bench) -> Point:
    """The point of the truth, its start state included."""
    run, time = bench.run.trajectory, problem.parts[0].record.time[0]
    k = int(np.searchsorted(run.time, time))
    state = {
        "start0.speed": run.output_speed[k],
        "start0.wheel_speed": run.wheel_speed[k],
        "start0.twist": run.twist[k],
    }
    return start.moved(
        np.array([state.get(n, v) for n, v in zip(start.names, start.values, strict=True)])
    )


def _with_std(
    problem: Problem, point: Point, covariance: FloatArray, bench: Bench
) -> dict[str, tuple[float, float]]:
    values = parameters(problem, point, [bench.signals])
    matrix = slopes(problem, point, np.sqrt(np.diag(covariance)), [bench.signals])
    variance = np.einsum("qp,pr,qr->q", matrix, covariance, matrix)
    pairs = zip(values.items(), variance, strict=True)
    found = {name: (value, float(np.sqrt(v))) for (name, value), v in pairs}
    element = bench.driveline.oncoming.name
    index = [point.names.index(f"{element}.{key}") for key in LAW]
    mu, by_law = stribeck(point.values[index], np.array(SLIPS))
    inner = covariance[np.ix_(index, index)]
    std = np.sqrt(np.einsum("pn,pq,qn->n", by_law, inner, by_law))
    for slip, m, s in zip(SLIPS, mu, std, strict=True):
        found[_mu(slip)] = (float(m), float(s))
    if "te_delay" not in point.names:
        del found["te_delay"]
    return found


def _told_linearly(shift: IntegralShift) -> dict[str, tuple[float, float]]:
    std = np.sqrt(np.diag(shift.covariance))
    found = {n: (float(v), float(s)) for n, v, s in zip(shift.ids, shift.values, std, strict=True)}
    if shift.friction is not None:
        fit = shift.friction.fit
        mu, by_law = stribeck(fit.theta, np.array(SLIPS))
        inner = fit.covariance[:4, :4]
        spread = np.sqrt(np.einsum("pn,pq,qn->n", by_law, inner, by_law))
        found |= {_mu(a): (float(m), float(s)) for a, m, s in zip(SLIPS, mu, spread, strict=True)}
    return found


def _collect(
    into: dict[str, list[Sample]],
    truth: Mapping[str, float],
    found: Mapping[str, tuple[float, float]],
) -> None:
    for name, (value, std) in found.items():
        if name in truth and std > 0.0:
            into.setdefault(name, []).append(Sample(value - truth[name], std))


def _mu(slip: float) -> str:
    return f"mu at {slip:g} rad/s"
