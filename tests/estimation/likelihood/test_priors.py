# SPDX-License-Identifier: MIT
"""Unknowns and priors: numbers of the card, what the log shows, values that are fixed."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from drivetwin.errors import InputError
from drivetwin.pipeline import identify
from drivetwin.shifts.detect import detect_shifts
from drivetwin.vehicle.spec import PriorValue
from tests.estimation.asked import record_log, still
from tests.estimation.likelihood.fixtures import bench, problem

HELD = 0.15
"""Time [s] from which a filled off-going element shows its friction."""


def _pose(**changes: Any) -> tuple[Any, Any]:
    return problem(replace(bench(), driveline=replace(bench().driveline, **changes)))


def test_fixed_values_are_met_exactly_and_one_inertia_alone_may_be_fixed() -> None:
    log, card = record_log("paper_steps")
    shifts = detect_shifts(log, card)
    fixed = {"J_prime_2": 17.4, "k_o": 1.75e5}
    found = identify(log, card, shifts, fixed=fixed)
    for name, value in fixed.items():
        assert found.estimates[name].value == pytest.approx(value, rel=1e-12)
    with pytest.raises(InputError, match="one inertia"):
        identify(log, card, shifts, fixed={"J_prime_2": 17.4, "J_prime_3": 17.0})


def test_a_prior_on_a_gear_inertia_is_one_on_the_sum() -> None:
    gear, ratio = bench().signals.shift.start_gear, bench().driveline.i_before
    known = {f"J_prime_{gear}": PriorValue(17.0, 0.1)}
    (with_sum, start), (without, _) = _pose(known=known), _pose(known={})
    steps = []
    for step in (0.0, 0.3, -0.2):
        values = start.values.copy()
        values[start.names.index("J_e")] += step
        costs = [one.prior.compute_prior_cost(values) for one in (with_sum, without)]
        miss = (start["J_e"] + step + start["J_out"] / ratio**2 - 17.0) / 0.1
        steps.append(costs[0] - costs[1] - miss**2)
    assert steps == pytest.approx([steps[0]] * 3, abs=1e-6)


def test_a_prior_on_the_engine_inertia_is_one_on_its_share_of_je() -> None:
    (posed, start), (free, _) = _pose(known={}, J1=PriorValue(5.0, 0.1)), _pose(known={})
    places = [start.names.index(name) for name in ("J_e", "eta")]
    added = posed.prior.precision - free.prior.precision
    assert np.count_nonzero(added) == 4
    change = np.array([5.1 * start["eta"], start["eta"]]) - posed.prior.mean[places]
    assert change @ added[np.ix_(places, places)] @ change == pytest.approx(1.0, rel=1e-6)


def test_an_exact_ratio_or_fixed_value_is_no_unknown() -> None:
    posed, start = _pose(known={"k_o": PriorValue(0.5)})
    assert posed.terms[0].plant.get_value(start, "k_o") == 0.5
    assert not {"k_o", "ratio_2", "ratio_3", "i_f"} & set(start.names)


def test_the_delay_is_held_where_the_engine_torque_does_not_move() -> None:
    assert still().estimates["te_delay"].value is None
    torque = bench().signals.engine_torque
    level = replace(torque, values=np.full(torque.values.size, 1500.0))
    made = replace(bench(), signals=replace(bench().signals, engine_torque=level))
    assert "te_delay" in problem(bench())[1].names
    assert "te_delay" not in problem(made)[1].names


@pytest.mark.parametrize(
    ("above", "noise", "seconds", "own"),
    [(3e5, 0.0, 0.5 * HELD, False), (3e5, 0.0, 2.0 * HELD, True), (14e3, 7e3, 3.0 * HELD, False)],
)
def test_an_offgoing_element_has_its_own_law_only_where_it_slips_under_load(
    above: float, noise: float, seconds: float, *, own: bool
) -> None:
    """Noise about P0 lifts single samples, some in a thousand, far enough over the whole of it."""
    made = bench()
    off, start = made.signals.pressures["B2"], made.signals.shift.inertia_phase[0]
    level = made.driveline.offgoing.P0.value + above
    held = level + noise * np.random.default_rng(0).standard_normal(off.time.size)
    values = np.where(off.time < start + seconds, held, 0.0)
    pressures = {**made.signals.pressures, "B2": replace(off, values=values)}
    long = replace(made.signals.shift, inertia_phase=(start, start + 1.0))
    signals = replace(made.signals, pressures=pressures, shift=long)
    names = problem(replace(made, signals=signals))[1].names
    assert ("B2.mu_c" in names) is own
    assert ("B2.level" in names) is not own
