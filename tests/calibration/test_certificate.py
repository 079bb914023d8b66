# SPDX-License-Identifier: MIT
"""Statistics of a calibration: order statistics that cover as stated, promise and front."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from drivetwin.calibration.certificate import certify, compute_promise
from drivetwin.calibration.metrics import Metric, Outcome
from drivetwin.calibration.objective import Limit, Statistic
from drivetwin.calibration.operating_map import Arm, FrontPoint, select_nondominated
from drivetwin.calibration.scenarios import Scenarios
from tests.support.arrays import FloatArray

TYPE_COUNT, UNIT_COUNT = 3000, 200
SIZE = st.floats(1.0, 100.0)
JERK, TIME = Metric.PEAK_JERK, Metric.SHIFT_TIME


def make_outcome(values: FloatArray, unlocked: bool = False, metric: Metric = JERK) -> Outcome:
    """Outcome of one metric; all units lock twice if they do not lock."""
    marks = np.full(values.size, unlocked)
    return Outcome({metric: values}, values[:, None], marks, marks)


def test_bound_of_a_quantile_covers_with_its_confidence() -> None:
    random = np.random.default_rng(5)
    found = [
        certify(make_outcome(random.random(200)), (), 0.95).quantiles[JERK] for _ in range(2000)
    ]
    share = np.mean([one.upper_95 is not None and one.upper_95 >= 0.95 for one in found])
    assert 0.94 <= share <= 0.985  # at least 95 % but for chance; the rank is a whole number
    assert 0.93 <= np.mean([one.mean_upper >= 0.5 for one in found]) <= 0.97


@pytest.mark.parametrize(("name", "least"), [("upper_95", 59), ("upper_99", 299)])
def test_least_number_of_draws(name: str, least: int) -> None:
    # 1 - share^n reaches 95 % at these numbers.
    few, enough = (
        certify(make_outcome(np.arange(float(count))), (), 0.95).quantiles[JERK]
        for count in (least - 1, least)
    )
    assert getattr(few, name) is None
    assert getattr(enough, name) == enough.worst == least - 1.0


def test_no_mark_bounds_the_share_by_the_rule_of_three() -> None:
    none, every = (certify(make_outcome(np.zeros(300), one), (), 0.95) for one in (False, True))
    assert none.unlocked_upper == pytest.approx(1.0 - 0.05 ** (1.0 / 300.0))
    assert none.relocked_upper == none.unlocked_upper
    assert every.unlocked_upper == every.relocked_upper == 1.0
    assert (none.unlocked, every.unlocked, every.relocked) == (0, 300, 300)


def test_states_of_limits() -> None:
    outcome = make_outcome(np.linspace(0.0, 1.0, 1001), metric=TIME)
    found = certify(outcome, [Limit(TIME, one) for one in (0.99, 0.951, 0.9)], 0.95)
    assert [one.state.name for one in found.limits] == ["CERTIFIED", "KEPT", "EXCEEDED"]
    assert [one.binding for one in found.limits] == [False, True, True]
    assert [one.excess > 0.0 for one in found.limits] == [False, True, True]
    (mean,) = certify(outcome, [Limit(TIME, 0.6, Statistic.MEAN)], 0.95).limits
    assert mean.text == "certified"
    assert mean.value == pytest.approx(0.5)
    assert found.worst_share == pytest.approx(0.05 ** (1.0 / 1001.0))


def test_the_promise_of_normal_stages_is_the_quantile_of_their_sum() -> None:
    random = np.random.default_rng(1)
    between, within = 3.0, 2.0
    types = np.repeat(random.normal(0.0, between, TYPE_COUNT), UNIT_COUNT)
    units, idle = random.normal(0.0, within, (2, types.size))
    sets = {"J1.inertia": types, "B2.gain": units, "B3.gain": idle, "start.engine": types + units}
    sets |= {"J_v.inertia": 2.0 * types}  # goes with J1: neither alone explains anything
    scenarios = Scenarios(sets, types.size)
    found = compute_promise(make_outcome(50.0 + types + units), scenarios, TYPE_COUNT, 0.9)
    expected = 50.0 + within * norm.ppf(0.95) + between * norm.ppf(0.9)
    assert found.levels[JERK] == pytest.approx(expected, abs=0.4)  # 4 standard errors
    share = between**2 / (between**2 + within**2)
    stages = ("uncertainty of identified values", "production scatter")
    expected_shares = {stages[0]: share, "J1": 0.0, "J_v": 0.0, "several together": share}
    expected_shares |= {"B2": 1.0 - share, "B3": 0.0}
    for name, value in expected_shares.items():
        assert found.shares[name] == pytest.approx(value, abs=0.05), name
    assert sum(found.shares[one] for one in stages) == pytest.approx(1.0)
    assert "start" not in found.shares


def make_point(jerk: float, energy: float, time: float, *exceeded: Limit) -> FrontPoint:
    """Point of a front with its figures."""
    return FrontPoint(Arm.TIME, np.zeros(1), jerk, energy, time, exceeded)


@given(st.lists(st.tuples(SIZE, SIZE, SIZE), min_size=1, max_size=12))
def test_no_point_of_a_front_is_worse_than_another_or_beyond_a_limit(
    figures: list[tuple[float, float, float]],
) -> None:
    beyond = make_point(0.1, 0.1, 0.1, Limit(Metric.VIBRATION_DOSE, 1.0))
    kept = select_nondominated([beyond, *(make_point(*one) for one in figures)])
    assert kept
    assert beyond not in kept
    for one in kept:
        for other in kept:
            if one is not other:
                assert (other.figures > one.figures).any()
