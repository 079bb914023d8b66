# SPDX-License-Identifier: MIT
"""Several shifts into one value each: derived parameters stay consistent, priors count once."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, cast

import numpy as np
import pytest

from drivetwin.estimation.linear.pipeline import IntegralShift, merge_shifts
from drivetwin.vehicle.spec import PriorValue
from tests.support.arrays import FloatArray


def _shift(
    ids: tuple[str, ...],
    values: list[float],
    covariance: FloatArray,
    priors: Mapping[str, PriorValue] = MappingProxyType({}),
) -> IntegralShift:
    nothing = cast("Any", None)
    return IntegralShift(
        nothing, nothing, nothing, None, ids, np.array(values), covariance, priors, refusals={}
    )


def test_a_parameter_that_follows_from_others_still_does() -> None:
    """Basic x and a gear's own z; derived y = 2x + z exactly, so every covariance is singular."""
    derive = np.array([[1.0, 0.0], [0.0, 1.0], [2.0, 1.0]])

    def shift(gear: str, x: float, z: float, std_z: float) -> IntegralShift:
        covariance = derive @ np.diag([0.04, std_z**2]) @ derive.T
        ids = ("J_vehicle", f"f_d_{gear}", "k_o")
        return _shift(ids, [x, z, 2.0 * x + z], covariance)

    ids, values, covariance = merge_shifts([shift("3", 5.1, 7.2, 0.01), shift("4", 4.9, 7.4, 0.3)])
    found = dict(zip(ids, values, strict=True))
    stds = dict(zip(ids, np.sqrt(np.diag(covariance)), strict=True))
    for gear in ("3", "4"):
        made = 2.0 * found["J_vehicle"] + found[f"f_d_{gear}"]
        assert found["k_o"] == pytest.approx(made, abs=0.01 * stds["k_o"])
    assert stds["J_vehicle"] < 0.2
    assert stds["k_o"] < np.hypot(2.0 * stds["J_vehicle"], 0.01) * 1.01


def test_what_is_made_by_a_product_tells_no_more_than_its_factors() -> None:
    """c = 2·δ·J and ζ = δ/ω of the same gear in nine shifts, each with slopes of its own."""
    rng = np.random.default_rng(3)
    omega, inertia, decay = 70.0, 5.0, 8.0
    std_J, std_rate = 0.15, 1.6

    def shift() -> IntegralShift:
        J = inertia + std_J * rng.standard_normal()
        rate = decay + std_rate * rng.standard_normal()
        slopes = np.array([[1.0, 0.0], [2.0 * rate, 2.0 * J], [0.0, 1.0 / omega]])
        covariance = slopes @ np.diag([std_J**2, std_rate**2]) @ slopes.T
        return _shift(("J_vehicle", "c_o", "zeta_3"), [J, 2.0 * rate * J, rate / omega], covariance)

    ids, values, covariance = merge_shifts([shift() for _ in range(9)])
    std = np.sqrt(np.diag(covariance))
    # As if exact the slopes contradict each other, and J seems to be told eighty times better.
    assert std[0] == pytest.approx(std_J / 3.0, rel=0.15)
    assert values[0] == pytest.approx(inertia, abs=3.0 * std[0])
    assert values[ids.index("zeta_3")] == pytest.approx(decay / omega, abs=3.0 * std[2])


def test_shifts_that_contradict_each_other_widen_the_interval() -> None:
    spread = np.diag([3.0**2])
    agreeing = [_shift(("c_o",), [c], spread) for c in (168.0, 170.0, 173.0)]
    _, value, covariance = merge_shifts(agreeing)
    assert covariance[0, 0] == pytest.approx(3.0**2 / 3.0, rel=1e-3)
    _, value, covariance = merge_shifts([*agreeing, _shift(("c_o",), [60.0], spread)])
    assert np.sqrt(covariance[0, 0]) == pytest.approx(27.6, abs=0.5)
    assert abs(value[0] - 170.0) < 1.96 * np.sqrt(covariance[0, 0])


def test_equal_shifts_halve_the_variance_but_for_the_prior() -> None:
    prior = PriorValue(1.0, 0.1)
    data = 0.2
    std = (prior.std**-2 + data**-2) ** -0.5
    spread = np.diag([0.01**2, std**2])
    one = _shift(("eta", "J_out"), [0.85, 1.05], spread, {"J_out": prior})
    ids, values, covariance = merge_shifts([one, one])
    assert ids == ("eta", "J_out")
    assert covariance[0, 0] == pytest.approx(0.01**2 / 2.0, rel=1e-5)
    assert covariance[1, 1] == pytest.approx(1.0 / (prior.std**-2 + 2.0 * data**-2), rel=1e-5)
    # 1.05 is the prior 1.0 and data 1.25 weighted; twice the data pulls further.
    assert values[1] == pytest.approx((1.0 / 0.01 + 2.0 * 1.25 / 0.04) / (1.0 / 0.01 + 2.0 / 0.04))


@pytest.mark.parametrize("count", [1, 2, 4])
def test_shifts_that_tell_nothing_leave_the_design_value_its_width(count: int) -> None:
    design, age = PriorValue(8e4, 5e3), PriorValue(0.02, 0.03)
    silent = _shift(
        ("P0.B3", "te_delay"),
        [design.value, age.value],
        np.diag([design.std**2, age.std**2]),
        {"P0.B3": design, "te_delay": age},
    )
    other = _shift(("P0.B4",), [8e4], np.array([[5e3**2]]), {"P0.B4": design})
    ids, values, covariance = merge_shifts([silent] * count + [other])
    assert ids == ("P0.B3", "te_delay", "P0.B4")
    assert values == pytest.approx([design.value, age.value, design.value])
    assert np.sqrt(np.diag(covariance)) == pytest.approx([5e3, 0.03, 5e3], rel=1e-6)


def test_a_nuisance_that_two_shifts_share_is_eliminated_from_both_together() -> None:
    """eta + a·drum is seen, with another `a` in each shift; the drum is known to its prior."""
    prior, noise, seen = PriorValue(0.05, 0.03), 0.01, ((1.0, 0.92), (3.0, 1.07))
    known = np.diag([0.5**-2, prior.std**-2])
    at = np.array([0.8, prior.value])

    def posterior(rows: tuple[tuple[float, float], ...]) -> tuple[FloatArray, FloatArray]:
        A, y = np.array([[1.0, a] for a, _ in rows]), np.array([y for _, y in rows])
        covariance = np.linalg.inv(known + A.T @ A / noise**2)
        return covariance @ (known @ at + A.T @ y / noise**2), covariance

    priors = {"eta": PriorValue(0.8, 0.5), "drum.B2": prior}
    shifts = []
    for row in seen:
        values, covariance = posterior((row,))
        shifts.append(_shift(("eta", "drum.B2"), values.tolist(), covariance, priors))
    ids, found, spread = merge_shifts(shifts)
    together, exact = posterior(seen)
    assert ids == ("eta",)
    assert found[0] == pytest.approx(together[0], rel=1e-4)
    assert spread[0, 0] == pytest.approx(exact[0, 0], rel=1e-3)
    assert merge_shifts(shifts[:1])[0] == ("eta",)


def test_one_shift_stays_as_it_is() -> None:
    one = _shift(("eta",), [0.85], np.array([[1e-4]]))
    ids, values, covariance = merge_shifts([one])
    assert (ids, values[0], covariance[0, 0]) == (("eta",), 0.85, 1e-4)


def test_loads_that_differ_leave_the_inertia_as_it_is() -> None:
    """J3 and load go together in each shift: one load for two grades would move J3."""
    ids = ("eta", "J_vehicle", "Tv_over_if")

    def shift(J3: float, load: float, with_J3: float) -> IntegralShift:
        rows = np.array([[0.01, 0.0, 0.0], [0.0, 40.0, 0.0], [0.0, with_J3, 4.0]])
        return _shift(ids, [0.9, J3, load], rows @ rows.T)

    told, values, covariance = merge_shifts([shift(4010.0, 900.0, 8.0), shift(3990.0, 300.0, -8.0)])
    assert told == ids
    assert values == pytest.approx([0.9, 4000.0, 598.0])
    assert covariance[1, 1] == pytest.approx(40.0**2 / 2.0, rel=1e-3)
    _, values, covariance = merge_shifts([shift(4010.0, 604.0, 8.0), shift(3990.0, 596.0, -8.0)])
    assert values[1] == pytest.approx(4000.0 - 16.0, abs=5.0)
    assert covariance[1, 1] < 0.5 * 40.0**2 / 2.0
