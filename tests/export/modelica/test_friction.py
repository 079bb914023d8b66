# SPDX-License-Identifier: MIT
"""Friction laws as tables that go on along their last piece, as the Standard Library does."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.export.modelica.friction import build_friction_rows
from drivetwin.simulation.dual_clutch import FrictionTable, Stribeck
from tests.support.arrays import FloatArray

SLIP = np.linspace(0.0, 500.0, 5001)


def _extended(rows: list[tuple[float, float]]) -> FloatArray:
    slip, mu = np.array(rows).T
    slope = (mu[-1] - mu[-2]) / (slip[-1] - slip[-2])
    beyond = np.maximum(SLIP - slip[-1], 0.0)
    return np.asarray(np.interp(SLIP, slip, mu) + slope * beyond, dtype=np.float64)


def test_a_stribeck_law_is_followed_far_beyond_the_table() -> None:
    law = Stribeck(mu_c=0.11, mu_s=0.15, v_s=6.0, mu_v=1e-4)
    rows = build_friction_rows({"mu_c": 0.11, "mu_s": 0.15, "v_s": 6.0, "mu_v": 1e-4})
    assert _extended(rows) == pytest.approx(law.evaluate(SLIP), rel=1e-4)


def test_a_table_stays_constant_beyond_its_end() -> None:
    table = FrictionTable((0.0, 10.0, 90.0), (0.14, 0.12, 0.13))
    rows = build_friction_rows({"slip": table.slip, "mu": table.mu})
    assert _extended(rows) == pytest.approx(table.evaluate(SLIP), rel=1e-12)


def test_a_table_that_goes_on_keeps_its_rows() -> None:
    law = {"slip": [0.0, 10.0], "mu": [0.14, 0.12], "extend": True}
    assert build_friction_rows(law) == [(0.0, 0.14), (10.0, 0.12)]
    assert build_friction_rows({"slip": [0.0], "mu": [0.1]}) == [(0.0, 0.1)]
