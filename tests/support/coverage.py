# SPDX-License-Identifier: MIT
"""Exact binomial test of the coverage of intervals, with a power that it states."""

from __future__ import annotations

import pytest
from scipy.stats import binom

CLAIMED = 0.95
"""Coverage that the intervals claim."""
TOO_LOW = 0.90
"""Coverage that the test must reject."""
LEVEL = 0.01
"""Probability on each side that intervals of the claimed coverage are rejected."""
POWER = 0.90
"""Least probability that intervals of coverage `TOO_LOW` are rejected."""

COARSE, FULL = 60, 400
"""Draws that reject a coverage of 80 %, and of 90 %, with `POWER`."""
LOWEST = {COARSE: 0.80, FULL: TOO_LOW}


def vary_draws(*, short: bool = False, slow: bool = False) -> pytest.MarkDecorator:
    """Parametrise a test by `draws`: a coarse case for every run, the full one for its suite.

    Of a `slow` test the coarse case is the short one of the suite, with `short` the full one.
    """
    suite, brief = pytest.mark.statistical, pytest.mark.short
    coarse = pytest.param(COARSE, marks=[suite, brief] if slow else [])
    full = pytest.param(FULL, marks=[suite, brief] if short else [suite])
    return pytest.mark.parametrize("draws", [coarse, full])


def compute_bounds(draws: int, claimed: float = CLAIMED) -> tuple[int, int]:
    """Return the smallest and the largest number of intervals that may contain the truth."""
    return int(binom.ppf(LEVEL, draws, claimed)), int(binom.isf(LEVEL, draws, claimed))


def compute_power(draws: int, claimed: float = CLAIMED, too_low: float = TOO_LOW) -> float:
    """Return the probability that intervals of coverage `too_low` are rejected."""
    return float(binom.cdf(compute_bounds(draws, claimed)[0] - 1, draws, too_low))


def assert_covers(inside: int, draws: int, *, conservative: bool = False) -> None:
    """Reject a coverage that differs from 95 %, given `inside` of `draws` independent intervals.

    Both tails are tested at `LEVEL`; with `conservative`, where intervals claim at least 95 %, only
    the lower one. Too few draws to reject the coverage in `LOWEST` with `POWER` are an error.
    """
    lowest = LOWEST.get(draws, TOO_LOW)
    power = compute_power(draws, too_low=lowest)
    assert power >= POWER, (
        f"{draws} draws reject a coverage of {lowest:.0%} in {power:.0%} of cases"
    )
    least, most = compute_bounds(draws)
    assert least <= inside <= (draws if conservative else most), (
        f"{inside} of {draws} intervals contain the truth ({inside / draws:.1%}); "
        f"95 % intervals: {least} to {most}"
    )
