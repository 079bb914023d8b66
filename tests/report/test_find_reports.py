# SPDX-License-Identifier: MIT
"""Agreement of several identifications."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivetwin.estimation.identification import Identification
from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.files.result_file import ResultFile
from drivetwin.report.find_reports import Candidate, compare_estimates
from drivetwin.twin.build import build_twin
from drivetwin.validation.simulate_log import attach_fit
from tests.report.sample import card, identification, validation


def candidate(name: str, **values: tuple[float, float | None]) -> Candidate:
    """A candidate that tells some parameters: value and standard deviation, None without one."""
    estimates = {
        key: Estimate(key, value, std, Verdict.IDENTIFIED, "integral")
        for key, (value, std) in values.items()
    }
    return Candidate(name, "integral", estimates, {}, {}, {}, "1")


def test_values_within_their_uncertainty_agree() -> None:
    (one,) = compare_estimates([candidate("a", eta=(0.90, 0.01)), candidate("b", eta=(0.92, 0.01))])
    assert one.apart == pytest.approx(0.02 / np.hypot(0.01, 0.01))
    assert one.agrees
    assert one.mean == pytest.approx(0.91)


def test_values_far_apart_differ() -> None:
    (one,) = compare_estimates(
        [candidate("a", eta=(0.90, 0.001)), candidate("b", eta=(0.92, 0.001))]
    )
    assert one.agrees is False


def test_one_value_alone_is_not_judged() -> None:
    found = compare_estimates([candidate("a", eta=(0.9, 0.01), k_o=(1e5, 1e3)), candidate("b")])
    assert [one.id for one in found] == ["eta", "k_o"]
    assert {one.agrees for one in found} == {None}
    assert found[0].estimates[1] is None


def test_a_value_without_an_interval_is_held_against_those_of_the_others() -> None:
    pair = [candidate("a", J3=(6059.7, 8.8)), candidate("b", J3=(6059.6, 8.8))]
    (far,) = compare_estimates([*pair, candidate("paper", J3=(6295.0, None))])
    assert far.apart == pytest.approx((6295.0 - 6059.6) / 8.8)
    assert far.agrees is False
    assert far.bare == (2,)
    (near,) = compare_estimates([pair[0], candidate("paper", J3=(6070.0, None))])
    assert near.agrees
    assert near.mean == pytest.approx(6059.7)


def test_values_without_any_interval_are_not_judged() -> None:
    (one,) = compare_estimates(
        [candidate("a", J3=(6000.0, None)), candidate("b", J3=(6295.0, None))]
    )
    assert one.agrees is None
    assert one.bare == (0, 1)


def test_a_value_that_is_not_told_has_no_row() -> None:
    refused = replace(candidate("a", eta=(0.9, 0.01)).estimates["eta"], value=None)
    assert compare_estimates([replace(candidate("a"), estimates={"eta": refused})]) == []


@given(
    st.lists(
        st.tuples(st.floats(0.1, 1e6), st.floats(1e-6, 1e3)),
        min_size=2,
        max_size=6,
    )
)
def test_the_mean_lies_between_the_values(values: list[tuple[float, float]]) -> None:
    (one,) = compare_estimates([candidate(str(k), k_o=pair) for k, pair in enumerate(values)])
    told = [value for value, _ in values]
    assert min(told) * (1 - 1e-9) <= one.mean <= max(told) * (1 + 1e-9)
    assert one.apart is not None
    assert one.apart >= 0.0


def found() -> Identification:
    return attach_fit(identification(), [validation()])


def test_result_and_twin_tell_the_same_parameters() -> None:
    result = Candidate.from_result("a", ResultFile.from_result(found()))
    twin = Candidate.from_twin("b", build_twin(found(), card()))
    assert list(result.estimates) == list(twin.estimates)
    assert result.fit["output_torque"]["all"].fit_percent > 90.0
    assert twin.fit == {}
    assert all(one.apart in (0.0, None) for one in compare_estimates([result, twin]))
