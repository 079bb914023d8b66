# SPDX-License-Identifier: MIT
"""Friction of all logs as one curve."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from drivetwin.fleet.figures import compute_fleet_friction
from tests.fleet.toys import fill, open_store


def test_the_middle_and_the_band_are_those_of_the_logs(tmp_path: Path) -> None:
    with open_store(tmp_path) as store:
        assert compute_fleet_friction(store) == {}
        for number in range(101):
            slips = np.linspace(5.0 + 0.01 * number, 100.0 - 0.3 * number, 30)
            level = 0.1 + 1e-4 * number
            rows = [("friction", "B3", level + 1e-4 * slip, {"at": slip}) for slip in slips]
            fill(store, f"{number:04d}", rows)
        curve = compute_fleet_friction(store)["B3"]
    inside = (curve.slip > 10.0) & (curve.slip < 69.0)
    assert np.count_nonzero(inside) > 10
    law = 1e-4 * curve.slip[inside]
    assert curve.mu[inside] == pytest.approx(0.105 + law, abs=1e-9)
    assert curve.mu_lo[inside] == pytest.approx(0.10025 + law, abs=1e-9)
    assert curve.mu_hi[inside] == pytest.approx(0.10975 + law, abs=1e-9)
