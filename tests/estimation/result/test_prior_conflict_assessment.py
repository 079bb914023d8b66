# SPDX-License-Identifier: MIT
"""Entries of the card that a fit contradicts: by the total covariance, and only while it holds."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from drivetwin.estimation.result.prior_conflict import FittedParameters
from drivetwin.vehicle.spec import PriorValue

DRIVELINE: Any = SimpleNamespace(find_prior={"J_out": PriorValue(0.9, 0.09)}.get)
FIT = FittedParameters(
    ids=("J_out", "k_o"),
    values=np.array([1.8, 1.5e5]),
    covariance=np.diag([0.01**2, 100.0**2]),
    std=np.array([0.01, 100.0]),
    driveline=DRIVELINE,
    systematic={},
    notes={},
    method="likelihood",
    prior_method="likelihood",
    total=np.diag([0.01**2, 100.0**2]),
)


def test_an_entry_is_accused_by_all_that_is_uncertain() -> None:
    """The effects move J_out by as much as it is off the card."""
    (by_noise,) = FIT.conflicts
    assert by_noise.apart > 9.0
    assert replace(FIT, total=np.diag([1.5**2, 100.0**2])).conflicts == ()


def test_doubt_never_makes_an_accusation() -> None:
    """A log with 1.8 deviations, in whose intervals effects leave as much doubt as the card."""
    prior = DRIVELINE.find_prior("J_out")
    log, std = prior.value - 1.8 * float(np.hypot(prior.std, 0.05)), 0.05
    own = 1.0 / (std**-2 + prior.std**-2)
    values = np.array([own * (log / std**2 + prior.value / prior.std**2), 1.5e5])
    fit = replace(FIT, values=values, covariance=np.diag([own, 100.0**2]))
    for doubt in (0.0, 0.5, 0.9, 0.95, 0.97):
        wide = replace(fit, total=np.diag([max(own, (doubt * prior.std) ** 2), 100.0**2]))
        assert wide.conflicts == ()


def test_an_accusation_goes_with_the_values_that_carry_it() -> None:
    assert len(FIT.list_conflicts({"k_o"})) == 1
    assert FIT.list_conflicts({"J_out"}) == ()
    assert FIT.list_conflicts({""}) == ()
