# SPDX-License-Identifier: MIT
"""Gain from an exact number of the card, against fits in which it is exact."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.estimation.likelihood.effects.correction import Correction, keep_fit
from drivetwin.estimation.likelihood.uncertainty.derived_parameters import (
    STATED,
    compute_jacobian,
    compute_parameters,
    rank_card_numbers,
)
from drivetwin.estimation.result.suggestion import CardNumberKind
from drivetwin.parameters import get_parameter_spec
from tests.estimation.asked import still, uncertain_fills


def test_gain_of_an_exact_fill_pressure_is_that_of_the_fit_with_it() -> None:
    """P0 of both elements is exact in one fit and has a deviation in the other. The other element
    slips little, so nearly all of the gain is that of B3."""
    loose, exact = uncertain_fills(), still()
    number = loose.evidence.numbers["mu_gain.B3"]
    assert (number.kind, number.name) == (CardNumberKind.PARAMETER, "P0.B3")
    stds = [one.estimates["mu_gain.B3"].std_total for one in (exact, loose)]
    assert stds[0] is not None
    assert stds[1] is not None
    assert number.share == pytest.approx(stds[0] / stds[1], rel=0.05)


def test_no_number_is_of_the_kind_of_the_parameter() -> None:
    for name, number in still().evidence.numbers.items():
        assert 0.0 <= number.share <= 1.0
        if number.kind is CardNumberKind.PARAMETER:
            stem = get_parameter_spec(number.name).stem
            assert stem in STATED
            assert stem != get_parameter_spec(name).stem


def _correct_loudly() -> tuple[Correction, tuple[str, ...], np.ndarray]:
    fit = still().evidence.likelihood
    assert fit is not None
    signals = still().evidence.signals
    std = np.sqrt(np.diag(fit.covariance))
    ids = tuple(compute_parameters(fit.problem, fit.point, signals))
    return keep_fit(fit), ids, compute_jacobian(fit.problem, fit.point, std, signals)


def test_share_is_the_conditional_deviation() -> None:
    """Against the conditional covariance by the inverse of the precision."""
    correction, ids, jacobian = _correct_loudly()
    numbers = rank_card_numbers(correction, ids, jacobian)
    covariance = jacobian @ correction.covariance @ jacobian.T
    number = numbers["k_o"]
    pair = [ids.index("k_o"), ids.index(number.name)]
    precision = np.linalg.inv(covariance[np.ix_(pair, pair)])
    then = precision[0, 0] ** -0.5
    assert number.share == pytest.approx(then / np.sqrt(covariance[pair[0], pair[0]]), rel=1e-6)
