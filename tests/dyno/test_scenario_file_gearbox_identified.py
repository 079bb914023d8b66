# SPDX-License-Identifier: MIT
"""Logs of the whole gearbox identified: truth within the interval, and what unstated drums do."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.dyno.files import format_card, format_log
from drivetwin.dyno.names import ScenarioName
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.method import Method
from drivetwin.logs.read import read_log
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.card import load_card
from tests.support.coverage import COARSE, assert_covers

SLIPS = np.array([10.0, 30.0, 50.0])
SEEDS = (1, 2)


def identified(bench: DynoRun, folder: Path, method: Method, *, drums: bool) -> Identification:
    """The identification of a run from its files, with P0 exactly known on the card; without
    `drums` the card knows of none."""
    text = re.sub(
        r"P0_bar = ([\d.]+)", r"P0_bar = { value = \1, std = 0.0 }", format_card(bench.scenario)
    )
    if not drums:
        stated = f"drum_inertia_kgm2 = {bench.scenario.model.elements[0].drum_inertia}"
        assert stated in text
        text = text.replace(stated, "drum_inertia_kgm2 = 0.0")
    (folder / "log.csv").write_text(format_log(bench), encoding="utf-8")
    (folder / "card.toml").write_text(text, encoding="utf-8")
    card = load_card(folder / "card.toml")
    log = read_log(folder / "log.csv", card)
    return identify(log, card, detect_shifts(log, card), method)


def test_truth_lies_in_the_intervals_where_the_card_states_the_drums(tmp_path: Path) -> None:
    """Of all 95 % intervals nine in ten hold at least, and none misses by its own width."""
    held = []
    for seed in SEEDS:
        bench = run(load_scenario(ScenarioName.GEARBOX), seed)
        found = identified(bench, tmp_path, Method.LIKELIHOOD, drums=True)
        assert found.method is Method.LIKELIHOOD
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
    assert len(held) >= 20
    assert np.mean(held) >= 0.9


@pytest.mark.statistical
@pytest.mark.timeout(900)
def test_intervals_cover_where_the_card_states_the_drums(tmp_path: Path) -> None:
    held: dict[str, list[bool]] = {}
    for seed in range(COARSE):
        bench = run(load_scenario(ScenarioName.GEARBOX), seed)
        found = identified(bench, tmp_path, Method.LIKELIHOOD, drums=True)
        for name, true in bench.truth.parameters.items():
            if (interval := found.estimates[name].ci95_total) is not None:
                held.setdefault(name, []).append(interval[0] <= true <= interval[1])
    told = {name: sum(each) for name, each in held.items() if len(each) == COARSE}
    assert len(told) >= 10
    for count in told.values():
        assert_covers(count, COARSE, conservative=True)


def predicted_bias(bench: DynoRun) -> float:
    """Relative error of μ where drums are left out: Σ I b ds/dt over b·T of the on-coming element.

    From the output side of the form, `Jo' ω_o' + Σ I b (b ω_o' - a ω_e') = b T - T_o`, mean over
    the inertia phase.
    """
    shift, motion, scenario = bench.truth.shifts[0], bench.trajectory, bench.scenario
    assert shift.inertia_start is not None
    assert shift.lockup is not None
    inside = (motion.time > shift.inertia_start + 0.05) & (motion.time < shift.lockup)
    time = motion.time[inside]
    moved = sum(
        each.drum_inertia * each.i_out * np.polyfit(time, motion.slip[each.name][inside], 1)[0]
        for each in scenario.model.elements
    )
    oncoming = scenario.get_element(scenario.oncoming)
    torque = motion.clutch_torque[oncoming.name][inside].mean()
    return float(moved / (oncoming.i_out * torque))


@pytest.mark.parametrize("drum", [0.05, 0.2])
def test_unstated_drums_show_as_less_friction_and_hardly_elsewhere(
    drum: float, tmp_path: Path
) -> None:
    """Against the log without drums and the same noise: sign and size of the closed form.

    About a percent of μ for 0.05 kg m^2, in proportion to the drum; the rest moves little.
    """
    plain, faulty = (run(load_scenario(ScenarioName.GEARBOX, d), SEEDS[0]) for d in (0.0, drum))
    base, found = (
        identified(each, tmp_path, Method.INTEGRAL, drums=False) for each in (plain, faulty)
    )
    mu = [np.interp(SLIPS, f.friction["C3"].slip, f.friction["C3"].mu) for f in (base, found)]
    for name in ("eta", "J_prime_2", "Tv_over_if", "J_vehicle", "k_o"):
        values = [f.estimates[name].value for f in (base, found)]
        assert values[0] is not None
        assert values[1] is not None
        assert abs(values[1] / values[0] - 1.0) < 0.05 * drum, name
    expected = predicted_bias(run(load_scenario(ScenarioName.GEARBOX, drum), noise=0.0))
    assert expected < 0.0
    assert np.mean(mu[1] / mu[0]) - 1.0 == pytest.approx(expected, rel=0.25)
