# SPDX-License-Identifier: MIT
"""Agreement of several identifications, and the page that compares them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from drivetwin.estimation.result.estimate import Estimate, Verdict
from drivetwin.report.comparison import (
    Candidate,
    build_comparison_page,
    compare_estimates,
    simulate_trials,
)
from drivetwin.report.html import render_page
from drivetwin.twin.build import build_twin
from tests.report.sample import SHIFT, card, friction, identification, log


def make_estimates(**values: tuple[float, float | None]) -> dict[str, Estimate]:
    """Estimates of value and standard deviation, None without one."""
    return {
        key: Estimate(key, value, std, Verdict.IDENTIFIED, "likelihood")
        for key, (value, std) in values.items()
    }


def make_candidate(name: str, **values: tuple[float, float | None]) -> Candidate:
    """A candidate with some parameters: value and standard deviation, None without one."""
    estimates = {
        key: Estimate(key, value, std, Verdict.IDENTIFIED, "likelihood")
        for key, (value, std) in values.items()
    }
    return Candidate(name, "likelihood", estimates, {}, {}, {}, "1")


def test_values_agree_within_their_uncertainty() -> None:
    near = [make_estimates(eta=(0.90, 0.01)), make_estimates(eta=(0.92, 0.01))]
    (one,) = compare_estimates(near)
    assert one.apart == pytest.approx(0.02 / np.hypot(0.01, 0.01))
    assert one.agrees
    far = [make_estimates(eta=(0.90, 0.001)), make_estimates(eta=(0.92, 0.001))]
    assert compare_estimates(far)[0].agrees is False
    alone = [make_estimates(eta=(0.9, 0.01), k_o=(1e5, 1e3)), make_estimates()]
    assert [one.agrees for one in compare_estimates(alone)] == [None, None]
    refused = replace(near[0]["eta"], value=None)
    assert compare_estimates([{"eta": refused}]) == []


def test_a_value_without_an_interval_is_held_against_those_of_the_others() -> None:
    pair = [make_estimates(J3=(6059.7, 8.8)), make_estimates(J3=(6059.6, 8.8))]
    (far,) = compare_estimates([*pair, make_estimates(J3=(6295.0, None))])
    assert far.apart == pytest.approx((6295.0 - 6059.6) / 8.8)
    assert (far.agrees, far.bare) == (False, (2,))
    (near,) = compare_estimates([pair[0], make_estimates(J3=(6070.0, None))])
    assert near.agrees
    bare = [make_estimates(J3=(6000.0, None)), make_estimates(J3=(6295.0, None))]
    (one,) = compare_estimates(bare)
    assert (one.agrees, one.bare) == (None, (0, 1))


def test_the_page_has_agreement_trials_and_refusals_and_is_escaped() -> None:
    good = build_twin(identification(), card())
    poor = replace(good, parameters={k: v for k, v in good.parameters.items() if k != "k_o"})
    trials = simulate_trials({"first <1>": good, "second": poor}, log(), [SHIFT], "sample.csv")
    assert trials[0].label == "sample.csv, 2→3 at 1.6 s"
    assert "k_o" in trials[0].refused["second"]
    first = make_candidate("first <1>", eta=(0.90, 0.001), k_o=(1e5, 1e3))
    second = make_candidate("second", eta=(0.92, 0.001), k_o=(1.01e5, 1e3))
    pair = [replace(first, friction={"B3": friction()}), second]
    page = render_page(build_comparison_page(pair, trials))
    for anchor in ("agreement", "logs", "shifts", "friction"):
        assert f'id="{anchor}"' in page
    assert "1 of 2 common parameters agree" in page
    assert "first <1>" not in page
    assert 'id="agreement"' not in render_page(build_comparison_page(pair[:1], trials))
