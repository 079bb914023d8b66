# SPDX-License-Identifier: MIT
"""Simulated shifts, made once per session."""

from __future__ import annotations

import pytest

from tests.estimation.synthetic import STEPPED, Run, Truth, run, upshift


@pytest.fixture(scope="session")
def stepped() -> Run:
    """Throttle steps in the lower gear, then a power-on upshift."""
    return run(Truth(), upshift(STEPPED))


@pytest.fixture(scope="session")
def constant() -> Run:
    """The same shift after two seconds at the paper's constant engine torque."""
    return run(Truth(), upshift(lambda _: 1545.0, at=2.0))
