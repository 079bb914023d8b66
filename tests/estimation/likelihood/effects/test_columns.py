# SPDX-License-Identifier: MIT
"""Columns of effects against differences of simulations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from drivetwin.estimation.likelihood.effects.columns import (
    EffectPriors,
    build_columns,
    observe,
)
from drivetwin.estimation.likelihood.effects.effect import (
    OperatingPoint,
    evaluate_operating_point,
)
from drivetwin.estimation.likelihood.effects.table import EFFECTS
from drivetwin.estimation.likelihood.effects.torques import REFERENCE_TORQUE
from drivetwin.estimation.result.cause import Group
from drivetwin.simulation.driveline_run import simulate
from drivetwin.simulation.dual_clutch import DualClutch, RoadLoad, Signal
from drivetwin.vehicle.effects import EffectId, EffectPrior
from tests.estimation.likelihood.fixtures import fitted
from tests.support.arrays import FloatArray
from tests.support.shared_results import shared

SMALL = 1e-3
"""Share of the prior size at which differences are formed."""


@shared
def operating_point() -> OperatingPoint:
    fit = fitted()
    found = evaluate_operating_point(fit.problem.terms[0], fit.point)
    assert found is not None
    return found


def answer(effect: EffectId, size: float = 1.0) -> FloatArray:
    """Change of the compared samples by the first column of an effect."""
    at = operating_point()
    return observe(at, EFFECTS[effect].build(at, size * EFFECTS[effect].std)[:1])[:, 0]


def difference(change: Callable[[DualClutch, Signal], tuple[DualClutch, Signal]]) -> FloatArray:
    """Change of the compared samples of a simulation by `change` of model and engine torque."""
    at = operating_point()
    term = at.term
    torque = term.get_acting_torque(at.point)
    runs = []
    for model, signal in ((at.model, torque), change(at.model, torque)):
        start = term.structure.build_start(at.point)
        run = simulate(model, signal, term.get_pressures(), start, term.record.time)
        runs.append(term.record.sample_run(run))
    return np.asarray(runs[1] - runs[0])


def assert_close(found: FloatArray, expected: FloatArray, rtol: float) -> None:
    at, first = operating_point(), 0
    for out in at.record.outputs:
        rows = slice(first, first + out.values.size)
        first = rows.stop
        scale = np.max(np.abs(expected[rows]))
        missed = np.sqrt(np.mean((found[rows] - expected[rows]) ** 2))
        assert missed < rtol * scale, out.name


def test_input_drag_is_a_lower_engine_torque() -> None:
    at = operating_point()
    size = SMALL * EFFECTS[EffectId.INPUT_DRAG].std * at.largest_engine_torque
    expected = difference(lambda m, s: (m, replace(s, values=s.values - size)))
    assert_close(SMALL * answer(EffectId.INPUT_DRAG), expected, 0.02)


def test_drums_are_inertias_that_turn_with_the_slip() -> None:
    at = operating_point()
    size = SMALL * EFFECTS[EffectId.DRUM_INERTIA].std * at.largest_engine_torque / REFERENCE_TORQUE
    name = EFFECTS[EffectId.DRUM_INERTIA].build(at, 1.0)[0].subject

    def add(model: DualClutch, torque: Signal) -> tuple[DualClutch, Signal]:
        elements = tuple(
            replace(one, drum_inertia=one.drum_inertia + size * (one.name == name))
            for one in model.elements
        )
        return replace(model, elements=elements), torque

    assert_close(SMALL * answer(EffectId.DRUM_INERTIA), difference(add), 0.05)


def test_a_load_that_grows_with_speed_holds_at_the_mean_speed() -> None:
    at = operating_point()
    speed = at.term.structure.mean_speed
    share = SMALL * EFFECTS[EffectId.AERO_LOAD].std * at.load * at.model.i_f
    load = at.model.load

    def grow(model: DualClutch, torque: Signal) -> tuple[DualClutch, Signal]:
        grown = RoadLoad(load.constant - share, load.rolling, load.aero + share / speed**2)
        return replace(model, load=grown), torque

    assert_close(SMALL * answer(EffectId.AERO_LOAD), difference(grow), 0.02)


def test_an_extended_driveline_tends_to_the_rigid_one() -> None:
    whole, small = answer(EffectId.TYRE_SLIP), answer(EffectId.TYRE_SLIP, SMALL)
    assert np.max(np.abs(whole)) > 0.0
    assert np.max(np.abs(small)) < 0.05 * np.max(np.abs(whole))


def test_an_effect_that_is_off_has_no_column_and_a_stated_one_is_taken_out() -> None:
    fit = fitted()
    drag = EffectId.INPUT_DRAG
    off = build_columns(fit.problem, fit.point, EffectPriors({drag: EffectPrior(0.0)}))
    assert off is not None
    assert Group(drag) not in off.groups
    assert not np.any(off.known[0])
    stated = EffectPriors({drag: EffectPrior(0.0, EFFECTS[drag].std)})
    known = build_columns(fit.problem, fit.point, stated)
    assert known is not None
    at = operating_point()
    both = observe(at, EFFECTS[drag].build(at, EFFECTS[drag].std))
    assert known.known[0] == pytest.approx(both.sum(axis=1))


def test_every_effect_has_one_entry_with_a_size_and_a_source() -> None:
    assert set(EFFECTS) == set(EffectId)
    for name, one in EFFECTS.items():
        assert one.id is name
        assert one.std > 0.0
        assert one.source
        assert one.meaning
        assert one.remedy
