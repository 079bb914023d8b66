# SPDX-License-Identifier: MIT
"""Unknowns of a shift: exact derivatives of its samples, laws of the elements, steps of the law."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from drivetwin.estimation.likelihood.effects.columns import EffectPriors
from drivetwin.estimation.likelihood.motion import simulate_motion
from drivetwin.estimation.likelihood.selection.plants import (
    build_plant_priors,
    drop_effect,
    extend_problem,
)
from drivetwin.estimation.likelihood.uncertainty.derived_parameters import differentiate
from drivetwin.simulation.dual_clutch import Stribeck
from drivetwin.vehicle.effects import EffectId, EffectPrior
from drivetwin.vehicle.spec import PriorValue
from tests.estimation.data.test_prepare_measured_ratios import rough_driveline
from tests.estimation.likelihood.fixtures import bench, problem
from tests.support.arrays import FloatArray

SIZES = {
    EffectId.INPUT_SHAFT_MODE: 60.0,
    EffectId.BACKLASH: 0.03,
    EffectId.TYRE_SLIP: 2e-3,
    EffectId.PROGRESSIVE_SHAFT: -0.05,
}
"""Usual sizes."""
RIGID = {EffectId.INPUT_SHAFT_MODE: 2e4, EffectId.BACKLASH: 1e-9}
"""Sizes at which a part hardly acts."""


def _pose(driveline: Any) -> tuple[Any, Any]:
    return problem(replace(bench(), driveline=driveline))


def _extend(effect: EffectId, size: float) -> tuple[Any, Any]:
    stated = EffectPriors({effect: EffectPrior(0.0, size)})
    priors = build_plant_priors(effect, stated, bench().driveline)
    return extend_problem(*problem(bench()), effect, priors)


def _add_idle_drum() -> tuple[Any, Any]:
    """A third element whose drum turns with the shift."""
    known = bench().driveline
    idle = replace(known.oncoming, name="K2", a=1.4, b=1.4, gear="4", drum=PriorValue(0.2, 0.1))
    posed, point = _pose(replace(known, couplings={**known.couplings, "K2": idle}))
    values = point.values.copy()
    values[point.names.index("K2.drum")] = 0.2
    return posed, point.replace_values(values)


def _difference(term: Any, point: Any, index: int, step: float) -> FloatArray:
    """Compute the central difference (n,) of the simulated samples by one unknown."""
    change = np.zeros_like(point.values)
    change[index] = step
    runs = [
        simulate_motion(term, point.replace_values(point.values + one)) for one in (change, -change)
    ]
    ahead, behind = (term.record.sample_run(one) for one in runs)
    return np.asarray((ahead - behind) / (2.0 * step))


def _assert_exact(posed: Any, point: Any, names: Iterable[str]) -> None:
    """Compare with differences of runs. A lock that moves over a sample, and the points of a table,
    differ by less than 1 %."""
    term = posed.terms[0]
    _, slopes = term.linearise(point)
    for name in names:
        k = point.names.index(name)
        size = float(np.linalg.norm(slopes[:, k] / term.record.sigma))
        assert size > 0.0, name
        whole, half = (_difference(term, point, k, one) for one in (0.3 / size, 0.15 / size))
        miss = np.linalg.norm(((4.0 * half - whole) / 3.0 - slopes[:, k]) / term.record.sigma)
        assert miss <= 0.01 * size + 1e-6, name


@pytest.mark.parametrize("effect", SIZES)
def test_derivatives_by_a_part_of_the_plant_are_exact(effect: EffectId) -> None:
    posed, point = _extend(effect, SIZES[effect])
    added = set(point.names) - set(problem(bench())[1].names)
    # Play that the torque does not cross does not act.
    _assert_exact(posed, point, ["k_o", *added] if effect is not EffectId.BACKLASH else ["k_o"])


def test_derivatives_by_all_other_unknowns_are_exact() -> None:
    """The law of B2 follows that of B3, so that the unknowns of B3 move both elements; those of
    the engine torque alone are by the linear response."""
    posed, point = _pose(rough_driveline())
    names = set(point.names) - {"te_delay", "te_offset"}
    assert names >= {"ratio_2", "ratio_3", "i_f", "B2.level", "B2.rest", "B3.mu_c"}
    _assert_exact(posed, point, names)


def test_an_idle_drum_turns_with_the_shift() -> None:
    posed, point = _add_idle_drum()
    assert posed.terms[0].plant.build_model(point).elements[2].drum_inertia == 0.2
    _assert_exact(posed, point, ["K2.drum"])


def test_a_drum_without_inertia_has_one_sided_derivatives() -> None:
    """A fit may end at the bound of a drum, beyond which there is no driveline."""
    posed, point = problem(bench())
    drum = point.names.index("B3.drum") if "B3.drum" in point.names else 0
    values = np.where(np.arange(point.values.size) == drum, posed.lower, point.values)

    def compute(at: Any) -> dict[str, float]:
        assert (at.values >= posed.lower).all()
        return {"square": float(at.values[drum]) ** 2 + float(at.values[drum])}

    std = np.full(values.size, 1e-3)
    found = differentiate(compute, point.replace_values(values), std, posed)
    assert found[0, drum] == pytest.approx(1.0 + 2.0 * posed.lower[drum], abs=1e-4)


@pytest.mark.parametrize("effect", RIGID)
def test_a_rigid_part_leaves_the_dual_clutch(effect: EffectId) -> None:
    posed, start = problem(bench())
    extended, point = _extend(effect, RIGID[effect])
    plain, found = (
        simulate_motion(one.terms[0], at) for one, at in ((posed, start), (extended, point))
    )
    assert plain
    assert found
    largest = np.max(np.abs(plain.shaft_torque))
    assert found.shaft_torque == pytest.approx(plain.shaft_torque, abs=2e-4 * largest)
    assert found.engine_speed == pytest.approx(plain.engine_speed, rel=1e-4)
    assert drop_effect(extended).cost(start) == posed.cost(start)


@cache
def _pose_once() -> tuple[Any, Any]:
    return problem(bench())


LAW = ("mu_c", "mu_drop", "mu_v", "ln_v_s")


def test_the_law_of_the_offgoing_element_is_a_level_of_its_partners() -> None:
    """Both gains may be off: their spreads widen the prior of the level."""
    posed, point = problem(bench())
    values = point.values.copy()
    values[point.names.index("B2.level")], values[point.names.index("B2.rest")] = 1.1, 0.01
    model = posed.terms[0].plant.build_model(point.replace_values(values))
    laws = {one.name: one.friction for one in model.elements}
    own, partner = laws["B2"], laws["B3"]
    assert isinstance(own, Stribeck)
    assert isinstance(partner, Stribeck)
    assert own.mu_c == pytest.approx(1.1 * partner.mu_c)
    assert own.mu_s - own.mu_c == pytest.approx(1.1 * (partner.mu_s - partner.mu_c) + 0.01)
    assert (own.v_s, own.mu_v) == pytest.approx((partner.v_s, 1.1 * partner.mu_v))


def test_a_tyre_of_a_vehicle_that_starts_from_rest_is_the_damper_of_a_slow_one() -> None:
    posed, point = _extend(EffectId.TYRE_SLIP, 2e-3)
    (term,) = posed.terms
    values = point.values.copy()
    values[point.names.index("start0.wheel_speed")] = 0.0
    at_rest = point.replace_values(values)
    tyre = term.plant.build_added_elements(at_rest, term.plant.build_model(at_rest)).tyre
    assert tyre is not None
    assert tyre.speed is not None
    assert tyre.speed > 0.0
    assert tyre.rim_inertia > 0.0
