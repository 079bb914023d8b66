# SPDX-License-Identifier: MIT
"""Drums of elements that take no part in the shift are in the model, with their derivative."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.estimation.data.prepare import build_driveline
from drivetwin.estimation.data.shift_data import ShiftElementKinematics
from drivetwin.estimation.likelihood.parametrization import LAW, RETRACTION_SLIPS, retract
from drivetwin.estimation.likelihood.priors import build_problem
from drivetwin.estimation.likelihood.uncertainty.derived_parameters import (
    compute_oscillation,
    compute_parameters,
)
from drivetwin.estimation.linear.friction_points import evaluate_stribeck
from drivetwin.estimation.optimize.objective import ParameterVector
from drivetwin.parameters import is_ratio
from drivetwin.simulation.dual_clutch import Stribeck
from drivetwin.vehicle.spec import PriorValue
from tests.estimation.data.test_prepare_measured_ratios import rough_driveline
from tests.estimation.likelihood.fixtures import bench, truth_of
from tests.shifts.fixtures import make_card

IDLE = ShiftElementKinematics("K2", 1.4, 1.4, 4.6e-2, PriorValue(8e4), "4", PriorValue(0.2, 0.1))
DRUM = "K2.drum"


def test_an_idle_drum_turns_with_the_shift() -> None:
    made = bench()
    couplings = {**made.driveline.couplings, "K2": IDLE}
    driveline = replace(made.driveline, couplings=couplings)
    posed, point = build_problem(
        [made.signals], [driveline], "paper", {**truth_of(made), DRUM: 0.2}
    )
    term = posed.terms[0]
    assert DRUM in point.names
    assert term.structure.build_model(point).elements[2].drum_inertia == 0.2
    found = term.linearise(point)
    assert found is not None
    k = point.names.index(DRUM)
    step = np.zeros(point.values.size)
    step[k] = 1e-3
    runs = [term.simulate(point.replace_values(point.values + sign * step)) for sign in (1.0, -1.0)]
    assert runs[0] is not None
    assert runs[1] is not None
    slope = (term.record.sample_run(runs[0]) - term.record.sample_run(runs[1])) / 2e-3
    before = term.record.time[term.record.outputs[0].place] < made.signals.shift.before[1] - 0.05
    column = found[1][: before.size, k]
    assert np.linalg.norm((column - slope[: before.size])[before]) < 1e-3 * np.linalg.norm(
        slope[: before.size][before]
    )
    told = compute_parameters(posed, point, [made.signals])
    assert told["drum.K2"] == pytest.approx(0.2)
    frequency, _ = compute_oscillation(term.structure, point)
    assert (
        frequency
        < compute_oscillation(term.structure, point.replace_values(point.values - 100.0 * step))[0]
    )


def test_an_element_breaks_away_at_the_peak_that_the_card_states() -> None:
    """The twin is simulated with it, so a fit without it would tell another friction."""
    made, card = bench(), make_card({"2": 1.91, "3": 1.43})
    elements = {**card.elements, "B3": replace(card.elements["B3"], peak=1.25)}
    driveline = build_driveline(replace(card, elements=elements), made.signals.shift)
    posed, point = build_problem([made.signals], [driveline], "paper", truth_of(made))
    model = posed.terms[0].structure.build_model(point)
    assert {one.name: one.peak for one in model.elements} == {"B2": 1.0, "B3": 1.25}


NAMES = ("eta", *(f"B3.{key}" for key in LAW), "B2.mu_c")
START = np.array([0.9, 0.11, 0.02, 1e-4, np.log(12.0), 0.12])


@given(
    st.lists(st.floats(-0.02, 0.02), min_size=3, max_size=3),
    st.floats(-np.log(12.0), np.log(5.0)),
)
def test_the_law_takes_the_step_in_its_values(mu: list[float], by_scale: float) -> None:
    step = np.array([0.01, mu[0], mu[1], 1e-2 * mu[2], by_scale, 0.003])
    before, slopes = evaluate_stribeck(START[1:5], RETRACTION_SLIPS)
    found = retract(ParameterVector(NAMES, START), step)
    assert evaluate_stribeck(found[1:5], RETRACTION_SLIPS)[0] == pytest.approx(
        before + slopes.T @ step[1:5], abs=1e-9
    )
    assert found[4] == START[4] + by_scale
    assert found[[0, 5]] == pytest.approx([0.91, 0.123])


def test_without_a_change_of_v_s_the_step_is_straight() -> None:
    step = np.array([0.0, 1e-3, -2e-3, 1e-5, 0.0, 0.0])
    assert retract(ParameterVector(NAMES, START), step) == pytest.approx(START + step)


@pytest.mark.parametrize("name", ["ratio_2", "ratio_3", "i_f", "B2.level", "B2.rest", "B3.mu_c"])
def test_ratios_and_a_partners_friction_have_exact_derivatives(name: str) -> None:
    """The law of B2 follows that of B3, so that the unknowns of B3 move both elements."""
    made = bench()
    posed, point = build_problem([made.signals], [rough_driveline()], "paper", truth_of(made))
    term, k = posed.terms[0], point.names.index(name)
    found = term.linearise(point)
    assert found is not None
    step = np.zeros(point.values.size)
    step[k] = 1e-6 * max(abs(point[name]), 1.0)
    runs = [term.simulate(point.replace_values(point.values + sign * step)) for sign in (1.0, -1.0)]
    ahead, behind = (term.record.sample_run(run) for run in runs if run is not None)
    slope = (ahead - behind) / (2.0 * step[k])
    assert np.abs(found[1][:, k] - slope).max() < 1e-4 * np.abs(slope).max()


def test_exactly_known_ratios_are_no_unknowns() -> None:
    made = bench()
    exact = rough_driveline(std=0.0)
    _, point = build_problem([made.signals], [exact], "paper", truth_of(made))
    assert not any(is_ratio(name) for name in point.names)


def test_the_law_of_the_offgoing_element_is_a_level_of_its_partners() -> None:
    made = bench()
    posed, point = build_problem([made.signals], [made.driveline], "paper", truth_of(made))
    values = point.values.copy()
    values[point.names.index("B2.level")], values[point.names.index("B2.rest")] = 1.1, 0.01
    moved = point.replace_values(values)
    laws = {e.name: e.friction for e in posed.terms[0].structure.build_model(moved).elements}
    own, partner = laws["B2"], laws["B3"]
    assert isinstance(own, Stribeck)
    assert isinstance(partner, Stribeck)
    assert own.mu_c == pytest.approx(1.1 * partner.mu_c)
    assert own.mu_s - own.mu_c == pytest.approx(1.1 * (partner.mu_s - partner.mu_c) + 0.01)
    assert (own.v_s, own.mu_v) == pytest.approx((partner.v_s, 1.1 * partner.mu_v))
