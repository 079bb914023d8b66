# SPDX-License-Identifier: MIT
"""What a sensor error does: one column for each sensor, under its name."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.estimation.likelihood.uncertainty.sensor_tolerance import Sensitivity
from drivetwin.report.figures.likelihood import plot_sensitivity


def test_a_time_is_told_in_ms_and_a_value_of_zero_in_no_per_cent() -> None:
    found = Sensitivity(
        ids=("te_delay.2", "P0.B2", "Tv_over_if", "eta"),
        values=np.array([0.0, 0.0, 0.0, 0.8]),
        errors=("engine_torque gain", "engine_torque offset"),
        sizes=np.array([0.01, 20.0]),
        change=np.array([[0.002, 0.0], [0.0, 0.0], [5.0, 0.0], [0.008, 0.0]]),
        slips={},
    )
    gain = plot_sensitivity(found).data[0]
    labels = ["τ_e (2) [ms]", "P0 (B2) [%]", "T_v/i_f [%]", "η [%]"]
    assert gain.y == labels
    assert [row[0] for row in gain.text] == ["+2.0", "·", "–", "+1.0"]


@pytest.mark.parametrize(("element", "angle"), [("B2", 0), ("Kupplung_K1", -90)])
def test_names_that_are_wider_than_their_column_are_turned(element: str, angle: int) -> None:
    roles = ("engine_torque", f"pressure.{element}")
    errors = tuple(f"{role} {kind}" for role in roles for kind in ("gain", "offset", "delay"))
    found = Sensitivity(
        ids=("eta",),
        values=np.array([0.85]),
        errors=errors,
        sizes=np.full(6, 0.01),
        change=np.full((1, 6), 0.001),
        slips={},
    )
    layout = plot_sensitivity(found).layout
    axes = (layout.xaxis, layout.xaxis2, layout.xaxis3)
    assert [one.tickangle for one in axes] == [angle] * 3
