# SPDX-License-Identifier: MIT
"""The test of logs against each other: its distribution, and what it names."""

from __future__ import annotations

from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import chi2

from drivetwin.estimation.identification import Identification
from drivetwin.estimation.multi_log.consistency import LogScore, compute_homogeneity
from drivetwin.findings import Code
from tests.estimation.multi_log.fixtures import loaded, together

DRAWS = 1000


def _pulls(rng: np.random.Generator, logs: int, size: int, rank: int) -> list[LogScore]:
    """Pulls of `logs` at their common minimum, of `size` unknowns each tells `rank` directions."""
    rows = [rng.standard_normal((rank, size)) for _ in range(logs)]
    noise = [rng.standard_normal(rank) for _ in range(logs)]
    total = sum((a.T @ a for a in rows), np.zeros((size, size)))
    best = np.linalg.pinv(total) @ sum(
        (a.T @ e for a, e in zip(rows, noise, strict=True)), np.zeros(size)
    )
    power, directions = np.linalg.eigh(total)
    root = directions[:, power > 1e-9] / np.sqrt(power[power > 1e-9])
    return [
        LogScore(k, root.T @ a.T @ a @ root, -root.T @ a.T @ (e - a @ best))
        for k, (a, e) in enumerate(zip(rows, noise, strict=True))
    ]


@settings(max_examples=4)
@given(st.integers(2, 4), st.integers(2, 5), st.integers(0, 10**6))
def test_of_logs_that_agree_it_is_chi_squared(logs: int, size: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    found = [compute_homogeneity(_pulls(rng, logs, size, 12)) for _ in range(DRAWS)]
    assert max(degrees for _, degrees in found) == (logs - 1) * size
    p = [chi2.sf(square, degrees) for square, degrees in found]
    # Uniform: mean 1/2 with a standard deviation of 1/sqrt(12·DRAWS).
    assert abs(float(np.mean(p)) - 0.5) < 4.0 / np.sqrt(12 * DRAWS)


def test_logs_that_tell_different_things_cannot_disagree() -> None:
    one = LogScore(1, np.diag([1.0, 0.0]), np.zeros(2))
    other = LogScore(2, np.diag([0.0, 1.0]), np.zeros(2))
    assert compute_homogeneity([one, other]) == (0.0, 0)


def _tested(found: Identification) -> Any:
    assert found.evidence.several is not None
    return found.evidence.several.consistency


def test_logs_of_one_vehicle_agree() -> None:
    tested = _tested(together().found)
    assert tested.agree
    assert tested.freedom >= 8
    assert tested.doubtful == {}
    assert "The logs agree on their shared parameters" in tested.text
    assert "mu.B3" in {one.parameter for one in tested.moves}


def test_a_payload_is_named_with_its_log_and_sign() -> None:
    tested = _tested(loaded().found)
    assert not tested.agree
    first = max(tested.moves, key=lambda one: abs(one.z))
    assert first.parameter == "J_vehicle"
    assert (first.z > 0.0) == (first.log == 2)
    assert "J_vehicle" in tested.text
    assert Code.LOGS_DISAGREE in [one.code for one in loaded().found.findings]
