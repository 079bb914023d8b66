# SPDX-License-Identifier: MIT
"""Shift of the paper: `Model.fit` beside the likelihood fit of `identify`, on the same noise.

The likelihood fit is that without effects: one search, no selection of the load or of the sampling
modes. Both start from the same direct estimates and have the same priors, except for the off-going
element: the likelihood fit gives it a level and a rise of its own, `Model.fit` its own mu_s. The
delay of the engine torque is minus the delay of the input.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks.estimation.study import SLIPS, compute_guess, propagate
from benchmarks.fit.report import format_header, format_row
from drivetwin.dyno import ScenarioName
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.likelihood.multistart import fit_multistart
from drivetwin.estimation.likelihood.parametrization import DualClutchTerm
from drivetwin.estimation.likelihood.priors import build_problem
from drivetwin.fit.expression import Expression
from drivetwin.fit.fixed_numbers import Tolerance
from drivetwin.fit.recording import Measured, Recording
from drivetwin.fit.unknown import Unknown
from drivetwin.likelihood.objective import LikelihoodObjective
from drivetwin.likelihood.point import ParameterVector
from drivetwin.likelihood.recorded_data import RECORD
from drivetwin.modeling.model import Model
from drivetwin.modeling.model_components import Component, Place
from drivetwin.simulation.driveline import ENGINE, OUTPUT, SHAFT, WHEEL, build_driveline
from drivetwin.simulation.dual_clutch import ENGINE_TORQUE, DualClutch, Signal, Stribeck
from drivetwin.simulation.network import Output
from tests.support.bench import Bench, Knowledge, record_bench

COUNT = 3
"""Noise realisations."""
MU_STD, MU_V_STD, DELAY_STD = 0.2, 2e-3, 0.03
"""Priors of the likelihood fit: mu_c and mu_s, mu_v [s/rad], delay of the engine torque [s]."""
OUTPUTS: dict[str, Output] = {
    "output_torque": ("shaft_torque", SHAFT),
    "engine_speed": ("speed", ENGINE),
    "output_speed": ("speed", OUTPUT),
    "wheel_speed": ("speed", WHEEL),
}


@dataclass(frozen=True)
class Fitted:
    """Estimates of one program: value and standard deviation by parameter; CPU time [s]."""

    estimates: Mapping[str, tuple[float, float]]
    seconds: float


def run(seed: int) -> str:
    """Fit all realisations by both programs.

    Parameters
    ----------
    seed
        Seed of the first realisation.

    Returns
    -------
    str
        Table by parameter: largest difference in standard deviations of the likelihood fit, ratio
        of the stated standard deviations.
    """
    differences: dict[str, list[float]] = {}
    ratios: dict[str, list[float]] = {}
    seconds = []
    for at in range(seed, seed + COUNT):
        likelihood, network = fit_both(at)
        seconds.append((likelihood.seconds, network.seconds))
        for name, (value, std) in network.estimates.items():
            other, spread = likelihood.estimates[name]
            differences.setdefault(name, []).append((value - other) / spread)
            ratios.setdefault(name, []).append(std / spread)
    head = ("parameter", "largest difference", "least ratio", "largest ratio")
    lines = ["## Shift of the paper: Model.fit beside identify", "", format_header(*head)]
    for name, found in differences.items():
        cells = [f"{max(map(abs, found)):.2f}"]
        cells += [f"{end(ratios[name]):.2f}" for end in (min, max)]
        lines.append(format_row(name, *cells))
    first, second = np.mean(seconds, axis=0)
    lines += ["", f"CPU time: likelihood fit {first:.1f} s, Model.fit {second:.1f} s.", ""]
    return "\n".join(lines)


def fit_both(seed: int) -> tuple[Fitted, Fitted]:
    """Fit the realisation of a seed by the likelihood fit and by `Model.fit`."""
    scenario = load_scenario(ScenarioName.PAPER_STEPS)
    bench = record_bench(scenario, seed, Knowledge())
    began = time.process_time()
    guess = compute_guess(bench)
    law = scenario.model.loss_law
    problem, start = build_problem([bench.signals], [bench.driveline], law, guess)
    first = time.process_time() - began
    found = fit_multistart(problem, start)
    values = propagate(problem, found.point, found.covariance, bench.signals)
    likelihood = Fitted(values, time.process_time() - began)
    began = time.process_time()
    network = _fit_network(bench, problem, start)
    return likelihood, Fitted(network, first + time.process_time() - began)


def _fit_network(
    bench: Bench, problem: LikelihoodObjective[DualClutchTerm], start: ParameterVector
) -> dict[str, tuple[float, float]]:
    term = problem.terms[0]
    dual = term.plant.build_model(start)
    record = term.record
    outputs = {
        one.name: Measured(record.time[one.place], one.values, one.sigma) for one in record.outputs
    }
    signals = bench.signals
    measured = {ENGINE_TORQUE: signals.engine_torque, **signals.pressures}
    inputs = {name: Signal(one.time, one.values) for name, one in measured.items()}
    unknowns = _build_unknowns(bench, dual, start)
    model = _build_model(bench, dual, start, inputs)
    named = ("gain", *(one.name for one in model.components))
    exact = dict.fromkeys(named, Tolerance(exact=True))
    recording = Recording(inputs, outputs)
    functions = _build_expressions(bench, dual)
    given = unknowns, OUTPUTS
    found = model.fit([recording], *given, tolerances=exact, expressions=functions, seed=0)
    derived = [name for name, one in functions.items() if one.paths is not None]
    names = ["eta", "J_vehicle", "k_o", "c_o", *derived]
    return {name: (found.values[name], found.std[name]) for name in names}


def _build_model(
    bench: Bench, dual: DualClutch, start: ParameterVector, inputs: Mapping[str, Signal]
) -> Model:
    model = Model("shift of the paper")
    model.add_elements(build_driveline(dual), inputs)
    speeds: dict[Place, float] = {OUTPUT: start["start0.speed"], WHEEL: start["start0.wheel_speed"]}
    twists: dict[Component | str, float] = {SHAFT: start["start0.twist"]}
    model.start(speeds, twists=twists, locked=[bench.driveline.offgoing.name])
    return model


def _build_unknowns(bench: Bench, dual: DualClutch, start: ParameterVector) -> dict[str, Unknown]:
    off, on = bench.driveline.offgoing.name, bench.driveline.oncoming.name
    law = next(one.friction for one in dual.elements if one.name == on)

    def share(key: str) -> tuple[str, ...]:
        return tuple(f"{one}.friction.{key}" for one in (on, off))

    guess = {key: float(getattr(law, key)) for key in ("mu_c", "mu_s", "v_s", "mu_v")}
    return {
        "eta": Unknown(dual.eta, paths=("i_in.loss.eta",)),
        "Je": Unknown(dual.J1 * dual.eta, bounds=(0.0, None)),
        "J_vehicle": Unknown(dual.J_v, paths=("J_v.inertia",)),
        "load": Unknown(dual.load.constant, paths=("load.constant",)),
        "k_o": Unknown(dual.k_o, paths=(f"{SHAFT}.stiffness",)),
        "c_o": Unknown(dual.c_o, paths=(f"{SHAFT}.damping",)),
        "delay": Unknown(
            -start["te_delay"],
            DELAY_STD,
            (-RECORD.max_delay, RECORD.max_delay),
            (f"delay.{ENGINE_TORQUE}",),
        ),
        "mu_c": Unknown(guess["mu_c"], MU_STD, paths=share("mu_c")),
        "drop": Unknown(guess["mu_s"] - guess["mu_c"]),
        "v_s": Unknown(guess["v_s"], guess["v_s"], paths=share("v_s")),
        "mu_v": Unknown(guess["mu_v"], MU_V_STD, paths=share("mu_v")),
        "drop of the off-going": Unknown(guess["mu_s"] - guess["mu_c"]),
    }


def _build_expressions(bench: Bench, dual: DualClutch) -> dict[str, Expression]:
    """Return the functions of the unknowns that the network contains, and the parameters that the
    likelihood fit reports."""
    off, on = bench.driveline.offgoing.name, bench.driveline.oncoming
    law = next(one.friction for one in dual.elements if one.name == on.name)
    output = bench.driveline.J_out
    assert output is not None
    assert isinstance(law, Stribeck)
    rest = law.mu_s

    def add(drop: str) -> Expression:
        return Expression(f"mu_c + {drop!r}", value=rest, std=MU_STD)

    return {
        "J1.inertia": Expression("Je / eta"),
        f"{on.name}.friction.mu_s": add("drop"),
        f"{off}.friction.mu_s": add("drop of the off-going"),
        "te_delay": Expression("-delay", paths=[]),
        f"J_prime_{on.gear}": Expression(f"Je + {output.value / on.ratio**2!r}", paths=[]),
        "Tv_over_if": Expression(f"load / {bench.driveline.i_f!r}", paths=[]),
        **{
            name: Expression(f"mu_c + drop * exp(-({slip!r} / v_s)) + mu_v * {slip!r}", paths=[])
            for name, slip in SLIPS.items()
        },
    }
