# SPDX-License-Identifier: MIT
"""What a sensor error does: one column for each sensor, under its name."""

from __future__ import annotations

import numpy as np
import pytest

from drivetwin.identify.likelihood.sensitivity import Sensitivity
from drivetwin.report.figures.sensitivity import sensitivity_figure


@pytest.mark.parametrize(("element", "angle"), [("B2", 0), ("Kupplung_K1", -90)])
def test_names_that_are_wider_than_their_column_are_turned(element: str, angle: int) -> None:
    roles = ("engine_torque", f"pressure.{element}")
    errors = tuple(f"{role} {kind}" for role in roles for kind in ("gain", "offset"))
    found = Sensitivity(
        ids=("eta",),
        values=np.array([0.85]),
        errors=errors,
        sizes=np.full(4, 0.01),
        change=np.full((1, 4), 0.001),
        slips={},
    )
    layout = sensitivity_figure(found).layout
    assert (layout.xaxis.tickangle, layout.xaxis2.tickangle) == (angle, angle)
