# SPDX-License-Identifier: MIT
"""Logs of the whole gearbox identified: truth within the interval, and what unstated drums do."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.dyno import ScenarioName
from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.identification import Identification
from tests.support.bench import identify_run
from tests.support.coverage import COARSE, assert_covers

SLIPS = np.array([10.0, 30.0, 50.0])


def identified(bench: DynoRun) -> Identification:
    """Identify a run with P0 exactly known on the card, which states the drums."""
    return identify_run(bench, P0_std=0.0)


def test_truth_lies_in_the_intervals_where_the_card_states_the_drums() -> None:
    """Of all 95 % intervals nine in ten hold at least, and none misses by its own width."""
    held = []
    bench = run(load_scenario(ScenarioName.GEARBOX), 1)
    found = identified(bench)
    for name, true in bench.truth.parameters.items():
        one = found.estimates[name]
        if name.startswith("P0") or one.value is None or one.ci95_total is None:
            continue
        low, high = one.ci95_total
        assert abs(true - one.value) < high - low, name
        held.append(low <= true <= high)
    curve, law = found.friction["C3"], bench.truth.friction["C3"]
    mu = np.interp(SLIPS, curve.slip, curve.mu)
    assert np.abs(mu / law.evaluate(SLIPS) - 1.0).max() < 5e-3
    assert len(held) >= 10
    assert np.mean(held) >= 0.9


@pytest.mark.statistical
@pytest.mark.timeout(900)
def test_intervals_cover_where_the_card_states_the_drums() -> None:
    held: dict[str, list[bool]] = {}
    for seed in range(COARSE):
        bench = run(load_scenario(ScenarioName.GEARBOX), seed)
        found = identified(bench)
        for name, true in bench.truth.parameters.items():
            if (interval := found.estimates[name].ci95_total) is not None:
                held.setdefault(name, []).append(interval[0] <= true <= interval[1])
    reported = {name: sum(each) for name, each in held.items() if len(each) == COARSE}
    assert len(reported) >= 10
    for count in reported.values():
        assert_covers(count, COARSE, conservative=True)
