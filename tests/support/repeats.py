# SPDX-License-Identifier: MIT
"""Cases of one kind: those of every day, and repeats for the nightly run."""

from __future__ import annotations

from collections.abc import Container, Iterable

import pytest


def mark_repeats(
    cases: Iterable[object],
    daily: Container[object],
    suite: pytest.MarkDecorator = pytest.mark.exhaustive,
) -> list[object]:
    """List cases of one argument; those not in `daily` run in the nightly `suite` only."""
    return [one if one in daily else pytest.param(one, marks=suite) for one in cases]
