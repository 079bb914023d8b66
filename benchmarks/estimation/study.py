# SPDX-License-Identifier: MIT
"""One scenario of the dynamometer: errors and standard deviations of fits, and their bound."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.estimation.bound import compute_bound
from drivetwin._util.arrays import FloatArray
from drivetwin.dyno.scenario import Scenario
from drivetwin.errors import IdentificationError
from drivetwin.estimation.data.shift_data import DesignData, ShiftSignals
from drivetwin.estimation.direct.friction_law import evaluate_stribeck
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.initial_guess import estimate_initial_values
from drivetwin.estimation.likelihood.parametrization import LAW, DualClutchProblem
from drivetwin.estimation.likelihood.priors import build_problem
from drivetwin.estimation.likelihood.selection.select_model import select_model
from drivetwin.estimation.likelihood.uncertainty.derived_parameters import (
    compute_jacobian,
    compute_parameters,
)
from drivetwin.likelihood.point import ParameterVector
from drivetwin.simulation.dual_clutch import Stribeck
from drivetwin.vehicle.spec import PriorValue
from tests.support.bench import Bench, Knowledge, record_bench

SLIPS = {f"mu at {slip:g} rad/s": slip for slip in (10.0, 30.0, 50.0)}
"""Slips [rad/s] at which the friction coefficient is compared, by the name in the tables."""


Estimates = dict[str, tuple[float, float]]
"""Value and standard deviation by parameter."""


def fit_seed(scenario: Scenario, know: Knowledge, seed: int) -> dict[str, Any]:
    """Fit a noise realisation; return errors and standard deviations by parameter, and CPU time."""
    bench = record_bench(scenario, seed, know)
    truth = build_truth(record_bench(scenario, 0, know, noise=0.0))
    begin, failure = time.process_time(), ""
    found: Estimates = {}
    try:
        found = read_fit(fit_likelihood(bench), bench)
    except IdentificationError as error:
        failure = error.what
    return {
        "seed": seed,
        "seconds": time.process_time() - begin,
        "failure": failure,
        "errors": {
            name: (value - truth[name], std)
            for name, (value, std) in found.items()
            if name in truth and std > 0.0
        },
    }


def list_values(outcome: Mapping[str, Any], bounds: Mapping[str, float]) -> list[dict[str, Any]]:
    """List one row for each value of an outcome that has a bound."""
    return [
        {
            "seed": outcome["seed"],
            "kind": outcome["kind"],
            "name": name,
            "sort": "estimate",
            "apart": error / std,
            "ratio": error / bounds[name],
        }
        for name, (error, std) in outcome["errors"].items()
        if bounds.get(name, 0.0) > 0.0
    ]


def list_bounds(
    kind: str, scenario: Scenario, know: Knowledge, bounds: Mapping[str, float]
) -> list[dict[str, Any]]:
    """List the bounds of a case, in percent of the truth; that of the delay in ms."""
    truth = build_truth(record_bench(scenario, 0, know, noise=0.0))
    return [
        {
            "kind": kind,
            "name": name,
            "bound": 1e3 * std if name == "te_delay" else 100.0 * std / truth[name],
            "unit": "ms" if name == "te_delay" else "%",
        }
        for name, std in bounds.items()
        if std > 0.0 and name in truth
    ]


def compute_guess(bench: Bench) -> dict[str, float]:
    """Return the initial value of every unknown, as `identify` computes it.

    The design ranges reach from half to twice the truth.
    """
    model = bench.run.scenario.model
    inertia = model.J1 * model.eta + model.J2e
    engine, vehicle = ((0.5 * one, 2.0 * one) for one in (inertia, model.J_v))
    design = DesignData(model.loss_law, model.i_f, engine, vehicle)
    return estimate_initial_values([bench.signals], [bench.driveline], design)


def fit_likelihood(bench: Bench) -> LikelihoodFit:
    """Fit by the likelihood method, as `identify` does."""
    law, guess = bench.run.scenario.model.loss_law, compute_guess(bench)
    return select_model([bench.signals], [bench.driveline], law, guess)[0]


def build_truth(bench: Bench) -> dict[str, float]:
    """Return the truth by id, with μ at the compared slips."""
    law = bench.run.truth.friction[bench.run.scenario.oncoming]
    mu = law.evaluate(np.array(list(SLIPS.values()))).tolist()
    return {**bench.truth, **dict(zip(SLIPS, mu, strict=True))}


def read_fit(fit: LikelihoodFit, bench: Bench) -> Estimates:
    """Return value and standard deviation of every parameter of a fit."""
    return propagate(fit.problem, fit.point, fit.covariance, bench.signals)


def compute_bounds(scenario: Scenario, know: Knowledge) -> dict[str, float]:
    """Compute the Cramér-Rao bound of every parameter, as a standard deviation."""
    clean = record_bench(scenario, 0, Knowledge(), noise=0.0)
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
    problem, start = build_problem([bench.signals], [driveline], law, build_guess(bench))
    truth = build_point(problem, start, bench)
    covariance = compute_bound(bench, problem.terms[0], truth, problem.prior)
    found = propagate(problem, truth, covariance, bench.signals)
    return {name: std for name, (_, std) in found.items()}


def build_guess(bench: Bench) -> dict[str, float]:
    """Return the truth by unknown of the fit."""
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


def build_point(
    problem: DualClutchProblem, start: ParameterVector, bench: Bench
) -> ParameterVector:
    """Return the point of the truth, its start state included."""
    run, time = bench.run.trajectory, problem.terms[0].record.time[0]
    k = int(np.searchsorted(run.time, time))
    state = {
        "start0.speed": run.output_speed[k],
        "start0.wheel_speed": run.wheel_speed[k],
        "start0.twist": run.twist[k],
    }
    return start.replace_values(
        np.array([state.get(n, v) for n, v in zip(start.names, start.values, strict=True)])
    )


def propagate(
    problem: DualClutchProblem,
    point: ParameterVector,
    covariance: FloatArray,
    signals: ShiftSignals,
    slips: Mapping[str, float] = SLIPS,
) -> Estimates:
    """Return value and standard deviation of every parameter at `point`, and of μ at `slips`."""
    values = compute_parameters(problem, point, [signals])
    matrix = compute_jacobian(problem, point, np.sqrt(np.diag(covariance)), [signals])
    variance = np.einsum("qp,pr,qr->q", matrix, covariance, matrix)
    pairs = zip(values.items(), variance, strict=True)
    found = {name: (value, float(np.sqrt(v))) for (name, value), v in pairs}
    element = problem.terms[0].plant.driveline.oncoming.name
    index = [point.names.index(f"{element}.{key}") for key in LAW]
    mu, by_law = evaluate_stribeck(point.values[index], np.array(list(slips.values())))
    std = np.sqrt(np.einsum("pn,pq,qn->n", by_law, covariance[np.ix_(index, index)], by_law))
    found |= dict(zip(slips, zip(mu.tolist(), std.tolist(), strict=True), strict=True))
    if "te_delay" not in point.names:
        found.pop("te_delay", None)
    return found
