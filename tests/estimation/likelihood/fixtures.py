# SPDX-License-Identifier: MIT
"""Fits of virtual-dyno logs with known truth."""

from __future__ import annotations

from typing import Any

import numpy as np

from drivetwin.dyno import ScenarioName
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.likelihood.multistart import fit_multistart
from drivetwin.estimation.likelihood.priors import build_problem
from tests.support.bench import Bench, Knowledge, record_bench
from tests.support.shared_results import shared

ROUGH = Knowledge(J_out=0.1, P0=5e3)


@shared
def bench(seed: int = 0, noise: float = 1.0, know: Knowledge = ROUGH) -> Bench:
    return record_bench(load_scenario(ScenarioName.THROTTLE_STEPS), seed, know, noise)


def truth_of(made: Bench) -> dict[str, float]:
    """Truth by unknown."""
    model = made.run.scenario.model
    values = {
        "eta": model.eta,
        "J_e": model.J1 * model.eta,
        "J_out": model.J_out,
        "J_vehicle": model.J_v,
        "Tv_over_if": model.load.constant / model.i_f,
        "k_o": model.k_o,
        "c_o": model.c_o,
        "te_delay": made.truth["te_delay"],
    }
    for one in model.elements:
        law = made.run.truth.friction[one.name]
        assert not hasattr(law, "slip")
        values |= {
            f"{one.name}.P0": one.P0,
            f"{one.name}.drum": one.drum_inertia,
            f"{one.name}.mu_c": law.mu_c,
            f"{one.name}.mu_drop": law.mu_s - law.mu_c,
            f"{one.name}.mu_v": law.mu_v,
            f"{one.name}.ln_v_s": float(np.log(law.v_s)),
        }
    return values


def problem(made: Bench, off: float = 0.0) -> tuple[Any, Any]:
    """The fit of a log, started `off` (relative) beside the truth, alternately up and down."""
    guess = {
        name: value * (1.0 + off * (-1) ** k)
        for k, (name, value) in enumerate(truth_of(made).items())
    }
    return build_problem([made.signals], [made.driveline], made.run.scenario.model.loss_law, guess)


@shared
def fitted(seed: int = 0) -> Any:
    made = bench(seed)
    posed, start = problem(made)
    return fit_multistart(posed, start)
