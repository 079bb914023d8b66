# SPDX-License-Identifier: MIT
"""Outcomes of the likelihood method from bad start values."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from concurrent.futures import ProcessPoolExecutor
from enum import StrEnum

import numpy as np

from benchmarks.estimation.study import build_guess, read_fit
from drivetwin.dyno import ScenarioName
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.errors import IdentificationError
from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.fit import LikelihoodFit
from drivetwin.estimation.likelihood.selection.select_model import select_model
from tests.support.bench import Bench, Knowledge, record_bench

OFF = 0.4
"""Start values lie so far beside the truth, at most, drawn evenly."""
SAME = 1.96
"""Difference of two minima in standard deviations of a parameter below which they are one: locks
make kinks in Q, and many small minima about P0 of the element that lets go."""
KNOW = Knowledge(J_out=0.1, P0=5e3)
TRIED = (ScenarioName.THROTTLE_STEPS, ScenarioName.PAPER_STEPS)
"""Scenarios of the tries, in turn."""
DESIGN = ("P0", "drum")
"""Unknowns that start from the card's value, which is drawn about the truth already."""


class Outcome(StrEnum):
    """End of a try: at the minimum that is found from the truth, refused, or elsewhere."""

    RIGHT = "right"
    REFUSED = "refused"
    WRONG = "wrong"


def count_outcomes(count: int) -> Counter[Outcome]:
    """Count the outcomes of tries, each with a noise realisation and start values of its own."""
    with ProcessPoolExecutor() as pool:
        return Counter(pool.map(try_start, range(count)))


def try_start(seed: int, off: float = OFF) -> Outcome:
    """Fit the realisation `seed` from start values up to `off` (relative) away from the truth."""
    bench = record_bench(load_scenario(TRIED[seed % len(TRIED)]), seed, KNOW)
    truth = build_guess(bench)
    try:
        found = _fit(bench, draw_start(truth, bench, seed, off))
    except IdentificationError:
        return Outcome.REFUSED
    return Outcome.RIGHT if _is_same(found, _fit(bench, truth), bench) else Outcome.WRONG


def draw_start(truth: Mapping[str, float], bench: Bench, seed: int, off: float) -> dict[str, float]:
    """Draw values up to `off` (relative) from `truth`; v_s itself is moved, not its logarithm."""
    rng = np.random.default_rng([seed, 2])
    card = {
        f"{name}.{key}": getattr(coupling, key).value
        for name, coupling in bench.driveline.couplings.items()
        for key in DESIGN
    }
    moved = {}
    for name, value in truth.items():
        factor = 1.0 + off * float(rng.uniform(-1.0, 1.0))
        moved[name] = value + np.log(factor) if name.endswith(".ln_v_s") else factor * value
    return {**moved, **card}


def _fit(bench: Bench, guess: Mapping[str, float]) -> LikelihoodFit:
    law = bench.run.scenario.model.loss_law
    return select_model([bench.signals], [bench.driveline], law, guess, EffectPriors())[0]


def _is_same(one: LikelihoodFit, other: LikelihoodFit, bench: Bench) -> bool:
    """Return whether two fits agree in every parameter."""
    reference = read_fit(other, bench)
    return all(
        abs(value - reference[name][0]) <= SAME * reference[name][1]
        for name, (value, _) in read_fit(one, bench).items()
        if reference[name][1] > 0.0
    )
