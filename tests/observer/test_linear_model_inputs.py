# SPDX-License-Identifier: MIT
"""What the course takes from a log, against the exact motion behind it."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.dyno import ScenarioName
from drivetwin.dyno.dyno import run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.observer.linear_model import collect_recorded, is_driving
from tests.observer.conftest import brief
from tests.support.bench import read_run


@pytest.mark.parametrize("name", [ScenarioName.POWER_OFF_UP, ScenarioName.POWER_OFF_DOWN], ids=str)
def test_power_flows_by_the_torque_at_the_gears(name: ScenarioName) -> None:
    """T_g = T_e - J1·ω_e': in a power-off upshift the engine drives although T_e is negative."""
    bench = run(load_scenario(name), seed=1)
    log, card = read_run(bench)
    shift = brief(log, card)
    model, motion = bench.scenario.model, bench.trajectory
    seen = collect_recorded(log, shift, card.i_in.value)
    found = is_driving(model, seen, bench.truth.parameters["te_delay"])
    rate = np.gradient(motion.engine_speed, motion.time)
    carried = bench.scenario.compute_torque(motion.time) - model.J1 * rate
    exact = np.interp(0.5 * (seen.time[1:] + seen.time[:-1]), motion.time, carried)
    # Noise and the swings of the shaft may turn the sign where little flows.
    clear = np.abs(exact) > 250.0
    assert clear.mean() > 0.2
    assert np.mean(found[clear] == (exact[clear] > 0.0)) > 0.98
    inside = (seen.time[1:] > shift.inertia_phase[0]) & (seen.time[1:] < shift.lockup_time)
    drives = float(name is ScenarioName.POWER_OFF_UP)
    assert np.mean(found[inside]) == pytest.approx(drives, abs=0.1)
