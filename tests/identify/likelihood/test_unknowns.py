# SPDX-License-Identifier: MIT
"""Drums of elements that take no part in the shift are in the model, with their derivative."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.identify.inputs import driveline_of
from drivetwin.identify.likelihood.derived import oscillation, parameters
from drivetwin.identify.likelihood.priors import problem_of
from drivetwin.identify.signals import Coupling
from drivetwin.vehicle.spec import PriorValue
from tests.identify.likelihood.made import bench, truth_of
from tests.shifts.made import make_card

IDLE = Coupling("K2", 1.4, 1.4, 4.6e-2, PriorValue(8e4), PriorValue(0.2, 0.1))
DRUM = "K2.drum"


def test_an_idle_drum_turns_with_the_shift() -> None:
    made = bench()
    couplings = {**made.driveline.couplings, "K2": IDLE}
    driveline = replace(made.driveline, couplings=couplings)
    posed, point = problem_of([made.signals], [driveline], "paper", {**truth_of(made), DRUM: 0.2})
    part = posed.parts[0]
    assert DRUM in point.names
    assert part.structure.model(point).elements[2].drum_inertia == 0.2
    found = part.linearised(point)
    assert found is not None
    k = point.names.index(DRUM)
    step = np.zeros(point.values.size)
    step[k] = 1e-3
    runs = [part.run(point.moved(point.values + sign * step)) for sign in (1.0, -1.0)]
    assert runs[0] is not None
    assert runs[1] is not None
    slope = (part.record.stacked(runs[0]) - part.record.stacked(runs[1])) / 2e-3
    before = part.record.time[part.record.outputs[0].place] < made.signals.shift.before[1] - 0.05
    column = found[1][: before.size, k]
    assert np.linalg.norm((column - slope[: before.size])[before]) < 1e-3 * np.linalg.norm(
        slope[: before.size][before]
    )
    told = parameters(posed, point, [made.signals])
    assert told["drum.K2"] == pytest.approx(0.2)
    frequency, _ = oscillation(part.structure, point)
    assert frequency < oscillation(part.structure, point.moved(point.values - 100.0 * step))[0]


def test_an_element_breaks_away_at_the_peak_that_the_card_states() -> None:
    """The twin is simulated with it, so a fit without it would tell another friction."""
    made, card = bench(), make_card({"2": 1.91, "3": 1.43})
    elements = {**card.elements, "B3": replace(card.elements["B3"], peak=1.25)}
    driveline = driveline_of(replace(card, elements=elements), made.signals.shift)
    posed, point = problem_of([made.signals], [driveline], "paper", truth_of(made))
    model = posed.parts[0].structure.model(point)
    assert {one.name: one.peak for one in model.elements} == {"B2": 1.0, "B3": 1.25}
