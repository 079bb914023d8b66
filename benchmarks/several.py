# SPDX-License-Identifier: MIT
"""Joint fits of two logs over many noise realisations: `python -m benchmarks.several [COUNT]`.

Two logs of the paper's vehicle, the second at 85 % of the engine torque and with 13 % less load,
are fitted as one; a third, like the first, is predicted. Printed are, over all realisations: how
much narrower the common interval is than that of the first log alone, how often it holds the
truth, how often the test of the logs against each other fires though they are of one vehicle, and
how often a right prediction is called worse than noise.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import drivetwin
from drivetwin.cli.synth import write_run
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario import Program, Scenario
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.validation import Outcome
from drivetwin.parameters import split_log_number
from drivetwin.shifts.detect import require_shifts
from drivetwin.simulation.dual_clutch import RoadLoad
from drivetwin.validation.validated_model import JointIdentification, Source, identify_together
from drivetwin.vehicle.card import VehicleCard
from drivetwin.vehicle.spec import PriorValue

COUNT = 40
LEVEL, LOAD = 0.85, 2000.0
J_OUT_SPREAD = 0.1
"""Standard deviation of the design value of Jo′ as a share of it."""


@dataclass(frozen=True)
class Outcomes:
    """One realisation: by parameter the deviation over its standard deviation, and the common
    standard deviation over that of the first log alone; p of the test; verdict on the prediction.
    """

    z: dict[str, float]
    narrower: dict[str, float]
    p: float
    prediction: Outcome


def make_lower_load() -> Scenario:
    """Return the paper's vehicle at less torque and load."""
    base = load_scenario("paper_steps")
    torque = Program(tuple((time, LEVEL * value) for time, value in base.engine_torque.knots))
    load = RoadLoad(constant=LOAD * base.model.i_f)
    return replace(base, engine_torque=torque, model=replace(base.model, load=load))


def measure_pair(seed: int) -> Outcomes:
    """Make three logs, fit two, predict the third. Jo′ of the card is drawn from its prior."""
    with tempfile.TemporaryDirectory() as folder:
        made = [load_scenario("paper_steps"), make_lower_load(), load_scenario("paper_steps")]
        files = [
            write_run(Path(folder) / f"log{k}.csv", run(one, seed=3 * seed + k))
            for k, one in enumerate(made)
        ]
        card = _draw_card(drivetwin.load_card(files[0][1]), made[0], seed)
        logs = [drivetwin.read_log(file, card) for file, _, _ in files]
    sources = [Source(log, require_shifts(log, card)) for log in logs]
    sources[2] = replace(sources[2], held=frozenset({1}))
    return _compare_pair(identify_together(sources, card), _find_truth(made[0]))


def _draw_card(card: VehicleCard, made: Scenario, seed: int) -> VehicleCard:
    """Draw a card whose design value of Jo′ errs by its standard deviation."""
    std = J_OUT_SPREAD * made.model.J_out
    value = made.model.J_out + std * float(np.random.default_rng(seed).standard_normal())
    return replace(card, J_out=PriorValue(value, std))


def _find_truth(made: Scenario) -> dict[str, float]:
    model = made.model
    load = model.load.constant / model.i_f
    shared = {"eta": model.eta, "J_out": model.J_out, "J_vehicle": model.J_v}
    shared |= {"k_o": model.k_o, "c_o": model.c_o}
    return {**shared, "Tv_over_if.1": load, "Tv_over_if.2": LOAD, "te_delay.1": 0.010}


def _compare_pair(made: JointIdentification, truth: dict[str, float]) -> Outcomes:
    found: Identification = made.found
    several, held = found.evidence.several, found.evidence.held_out
    assert several is not None
    z, narrower = {}, {}
    for name, value in truth.items():
        one, number = found.estimates[name], split_log_number(name)[1] or 1
        alone = several.logs[number - 1].alone[split_log_number(name)[0]]
        assert one.value is not None
        assert one.std_noise is not None
        assert alone.std_noise is not None
        z[name] = (one.value - value) / one.std_noise
        narrower[name] = one.std_noise / alone.std_noise
    return Outcomes(z, narrower, several.consistency.p, held[0].outcome)


def _format_rows(found: list[Outcomes]) -> Iterator[str]:
    yield "| parameter | σ together / σ alone | mean z | rms z | in 95 % |"
    yield "|---|---|---|---|---|"
    for name in found[0].z:
        z = np.array([one.z[name] for one in found])
        ratio = float(np.median([one.narrower[name] for one in found]))
        inside = 100.0 * float(np.mean(np.abs(z) < 1.96))
        yield (
            f"| {name} | {ratio:.2f} | {z.mean():+.2f} | {np.sqrt(np.mean(z**2)):.2f} "
            f"| {inside:.0f} % |"
        )
    alarms = sum(one.p < 0.01 for one in found)
    worse = sum(one.prediction is not Outcome.ALLOWED for one in found)
    yield f"{len(found)} pairs; logs said to disagree: {alarms}; prediction not allowed: {worse}"


def main() -> int:
    """Print the table over as many realisations as asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("count", type=int, nargs="?", default=COUNT, help="pairs of logs")
    found = []
    for seed in range(parser.parse_args().count):
        found.append(measure_pair(seed))
        print(f"{seed + 1} done", file=sys.stderr, flush=True)
    print("\n".join(_format_rows(found)))
    return 0


if __name__ == "__main__":
    sys.exit(main())
