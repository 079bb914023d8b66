# SPDX-License-Identifier: MIT
"""Choices of a model by its log: load, sampling of the signals, minimum, plant, loss law.

Each log is identified as a user's would be. The code in its findings names the decision, and the
truth lies within the intervals.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

from benchmarks.estimation.mismatch_log import Rates, make_mismatch_log
from drivetwin.channels.roles import Quantity
from drivetwin.dyno.dyno import DynoRun, run
from drivetwin.dyno.scenario_file import load_scenario
from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Verdict
from drivetwin.findings import Code
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.simulation.dual_clutch import RoadLoad
from drivetwin.vehicle.effects import EffectId
from tests.estimation.asked import stepped
from tests.support.bench import NO_EFFECT, identify_run

RATE = 400.0
"""Hz of the logger: less than usual, so that a fit takes less time."""
DRIVELINE = ("eta", "J_prime_2", "J_vehicle", "k_o", "c_o", "te_delay")
NIGHTLY = pytest.mark.exhaustive


def _replace_sensors(base: Any, change: Callable[[Any], Any]) -> Any:
    return replace(base, sensors=tuple(change(one) for one in base.sensors))


def _load(name: str) -> Any:
    base = load_scenario(name)
    return _replace_sensors(base, lambda one: replace(one, rate=min(one.rate, RATE)))


def _record_growing_load() -> DynoRun:
    base = _load("throttle_steps")
    load = RoadLoad(base.model.load.constant, aero=4.0)
    return run(replace(base, model=replace(base.model, load=load)), seed=0)


def _record_means(rate: float, torque: bool = False, lost: bool = False) -> DynoRun:
    """Speeds sent at `rate` [Hz] as means since the one before; so is the output torque, or it is
    `lost`."""

    def send(one: Any) -> Any:
        is_mean = one.quantity is Quantity.SPEED or (torque and one.role == "output_torque")
        return replace(one, rate=rate, window=1.0 / rate) if is_mean else one

    base = _replace_sensors(_load("paper_steps"), send)
    kept = tuple(one for one in base.sensors if not lost or one.role != "output_torque")
    return run(replace(base, sensors=kept), seed=6 if torque else 2)


def _record_rare_torque() -> DynoRun:
    """A smooth engine torque of which a sample comes every 20 ms."""
    base = _load("paper_steps")
    time = np.arange(0.0, base.duration, 2e-3)
    smooth = uniform_filter1d(uniform_filter1d(base.engine_torque.evaluate(time), 25), 25)
    pedal = replace(base.engine_torque, knots=tuple(zip(time, smooth, strict=True)))

    def send(one: Any) -> Any:
        is_torque = one.role == "engine_torque"
        return replace(one, rate=50.0, noise=0.5, resolution=0.0) if is_torque else one

    return run(_replace_sensors(replace(base, engine_torque=pedal), send), seed=0)


def _record_lingering() -> DynoRun:
    """The off-going element is held 5 kPa above its P0 while it slips: noise crosses P0."""
    base = _load("paper_steps")
    (one, _), actuator = base.model.elements, base.actuators["B2"]
    held = one.P0 + 5e3
    knots = tuple((time, max(value, held)) for time, value in actuator.command.knots)
    command = replace(actuator.command, knots=(*knots, (2.75, held), (2.80, 0.0)))
    changed = {**base.actuators, "B2": replace(actuator, command=command)}
    return run(replace(base, actuators=changed), seed=1)


def _record_effect(effect: EffectId, size: float) -> DynoRun:
    return run(load_scenario("throttle_steps"), seed=0, effects={effect: size})


def _record_other_law() -> DynoRun:
    """A lock-up oscillation reverses the torque through the gears."""
    base = _load("paper_steps")
    return run(replace(base, model=replace(base.model, loss_law="dissipative")), seed=0)


@dataclass(frozen=True)
class Case:
    """A log, its card's entries, the codes that it must cause, and the parameters that must be
    true; `truth` has those that the run's truth does not list."""

    record: Callable[[], DynoRun]
    codes: tuple[Code, ...] = ()
    names: Sequence[str] = DRIVELINE
    truth: dict[str, float] | None = None
    P0_std: float | None = None
    effects: Any = None
    loss_law: str = "paper"


ALL: Any = {}
CASES = {
    "growing load": Case(_record_growing_load, (Code.LOAD_GROWS,), ("J_vehicle", "k_o")),
    "speeds are means": Case(lambda: _record_means(200.0), (Code.MEAN_SAMPLES,)),
    "slow outputs are means": Case(
        lambda: _record_means(50.0, torque=True), (Code.MEAN_SAMPLES,), P0_std=5e3, effects=ALL
    ),
    "means without an output torque": Case(
        lambda: _record_means(100.0, lost=True), (Code.MEAN_SAMPLES,), ("te_delay",)
    ),
    "rare engine torque is a curve": Case(_record_rare_torque),
    "pressure near P0": Case(_record_lingering, names=("k_o", "P0.B2"), P0_std=5e3),
    "engine swings on its shaft": Case(
        lambda: _record_effect(EffectId.INPUT_SHAFT_MODE, 29.0),
        (Code.EFFECT_IN_PLANT,),
        ("k_o", "mode_frequency"),
        {"mode_frequency": 29.0},
        effects=ALL,
    ),
    "tyres slip by 0.6 %": Case(
        lambda: _record_effect(EffectId.TYRE_SLIP, 6e-3), (Code.EFFECT_IN_PLANT,), effects=ALL
    ),
    "progressive shaft": Case(
        lambda: _record_effect(EffectId.PROGRESSIVE_SHAFT, 0.05), (), ("J_vehicle",), effects=ALL
    ),
    "card has another loss law": Case(_record_other_law, (Code.OTHER_LOSS_LAW,), ()),
}
AT_NIGHT = (
    "slow outputs are means",
    "means without an output torque",
    "pressure near P0",
    "tyres slip by 0.6 %",
    "progressive shaft",
)


def _assert_true(found: Identification, truth: dict[str, float], names: Sequence[str]) -> None:
    for name in names:
        one = found.estimates[name]
        assert one.value is not None, name
        assert one.std_total, name
        assert abs(one.value - truth[name]) < 3.5 * one.std_total, name


@pytest.mark.parametrize(
    "name", [pytest.param(k, marks=[NIGHTLY] * (k in AT_NIGHT)) for k in CASES]
)
def test_a_decision_is_named_and_leaves_the_values_true(name: str) -> None:
    case = CASES[name]
    made = case.record()
    effects = NO_EFFECT if case.effects is None else case.effects
    found = identify_run(made, case.P0_std, effects=effects, loss_law=case.loss_law)
    codes = {one.code for one in found.findings}
    assert codes >= set(case.codes)
    _assert_true(found, made.truth.parameters | (case.truth or {}), case.names)


def test_a_log_as_modelled_decides_for_nothing() -> None:
    codes = {one.code for one in stepped().findings}
    assert not codes & {
        Code.LOAD_GROWS,
        Code.MEAN_SAMPLES,
        Code.EFFECT_IN_PLANT,
        Code.EFFECT_EXCLUDED,
        Code.RESIDUAL_CORRELATED,
        Code.CARD_CONTRADICTED,
    }


@pytest.mark.statistical
@pytest.mark.short
def test_backlash_that_the_dual_clutch_cannot_follow_is_identified() -> None:
    size = 0.04
    made = make_mismatch_log(1049, EffectId.BACKLASH, size, Rates.BUS)
    found = identify(made.log, made.card, detect_shifts(made.log, made.card))
    cause = found.evidence.cause
    assert cause is not None
    assert cause.group.effect is EffectId.BACKLASH
    assert cause.size == pytest.approx(size, rel=0.1)
    truth = made.recorded.truth.parameters
    identified = {n: e for n, e in found.estimates.items() if e.verdict is Verdict.IDENTIFIED}
    assert len(identified.keys() & truth.keys()) >= 8
    _assert_true(found, truth, [*(identified.keys() & truth.keys())])
    largest = np.max(np.abs(made.recorded.trajectory.shaft_torque))
    gap = 2.0 * size * largest / made.recorded.scenario.model.k_o
    assert found.estimates["backlash"].value == pytest.approx(gap, rel=0.15)
