# SPDX-License-Identifier: MIT
"""Draws of models: joint with the friction laws, ratios and partners included."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.estimation.result.estimate_set import JointCovariance
from drivetwin.simulation.dual_clutch import Stribeck
from drivetwin.twin.build import build_twin
from drivetwin.twin.distribution import describe_model
from drivetwin.twin.twin import Twin
from drivetwin.vehicle.spec import PriorValue
from tests.report.sample import SHIFT, STRIBECK, card, identification

IDS = ("eta", "P0.B3")
LAW = ("mu_c", "mu_drop", "mu_v", "ln_v_s")
PARTNER_LEVEL_STD = 0.07
"""Stated spread of the friction of an element relative to its partner's."""
LAW_STD = np.array([2e-3, 3e-3, 1e-5, 0.1])
CORRELATION = -0.9
"""Of μ_c and P0: a higher P0 goes with a higher friction or a lower one."""


def make_twin() -> Twin:
    """A twin whose friction of B3 is correlated with its P0."""
    found = identification()
    stds = [found.estimates[name].std_total or 0.0 for name in IDS]
    scale = np.concatenate([stds, LAW_STD])
    correlation = np.eye(scale.size)
    correlation[1, 2] = correlation[2, 1] = CORRELATION
    ids = (*IDS, *(f"{key}.B3" for key in LAW))
    joint = JointCovariance(ids, np.outer(scale, scale) * correlation)
    return build_twin(replace(found, joint=joint), card())


def draw_laws(twin: Twin, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Draw P0 of B3, μ_c of B3 and μ_c of B2."""
    known = replace(describe_model(twin, SHIFT, IDS), scales={})
    random = np.random.default_rng(3)
    directions, rows = known.directions, []
    for _ in range(count):
        model = known.draw_model(known.draw(random, directions), random)
        assert model is not None
        old, new = model.elements
        assert isinstance(old.friction, Stribeck)
        assert isinstance(new.friction, Stribeck)
        rows.append((new.P0, new.friction.mu_c, old.friction.mu_c))
    P0, own, partner = np.array(rows).T
    return P0, own, partner


def test_an_element_without_a_law_has_that_of_its_partner_with_a_level_of_its_own() -> None:
    twin = build_twin(identification(), card())
    _, _, partner = draw_laws(twin, 600)
    assert partner.std() / partner.mean() == pytest.approx(PARTNER_LEVEL_STD, rel=0.15)
    rough = {name: replace(one, gain_std=0.1 * one.gain) for name, one in twin.elements.items()}
    _, _, partner = draw_laws(replace(twin, elements=rough), 600)
    both = np.sqrt(PARTNER_LEVEL_STD**2 + 2.0 * 0.1**2)
    assert partner.std() / partner.mean() == pytest.approx(both, rel=0.15)


def test_a_drawn_friction_has_no_spread_of_the_gain() -> None:
    found = identification()
    rough = {name: one.add_gain_spread(PriorValue(0.03, 0.003)) for name, one in
             found.friction.items()}  # fmt: skip
    exact, wide = (
        describe_model(build_twin(replace(found, friction=one), card()), SHIFT, IDS)
        for one in (found.friction, rough)
    )
    assert wide.scales == pytest.approx(exact.scales)
    np.testing.assert_array_equal(wide.covariance, exact.covariance)


def test_friction_is_drawn_with_what_it_is_correlated_with() -> None:
    twin = make_twin()
    twin = replace(twin, friction={**twin.friction, "B2": twin.friction["B3"]})
    ids = (*twin.covariance_ids, *(f"{key}.B2" for key in LAW))
    assert twin.covariance is not None
    size = len(twin.covariance_ids)
    wide = np.zeros((len(ids), len(ids)))
    wide[:size, :size] = twin.covariance
    P0, own, _ = draw_laws(replace(twin, covariance_ids=ids, covariance=wide), 600)
    assert np.corrcoef(P0, own)[0, 1] == pytest.approx(CORRELATION, abs=0.05)
    assert own.std() == pytest.approx(LAW_STD[0], rel=0.15)
    assert own.mean() == pytest.approx(STRIBECK.mu_c, abs=4.0 * LAW_STD[0] / np.sqrt(600))


def test_a_drawn_ratio_moves_the_model() -> None:
    twin = build_twin(identification(), card())
    known = describe_model(twin, SHIFT, ("i_f", "ratio_3"))
    base = known.build_model(np.array([5.38, 1.43, *known.values[2:]]))
    moved = known.build_model(np.array([5.4, 1.44, *known.values[2:]]))
    assert moved.i_f == 5.4
    assert moved.get_overall_ratio("B3") == pytest.approx(1.44)
    assert moved.get_overall_ratio("B2") == pytest.approx(base.get_overall_ratio("B2"))
