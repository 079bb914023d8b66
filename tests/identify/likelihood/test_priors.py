# SPDX-License-Identifier: MIT
"""Between what bounds the unknowns are sought."""

from __future__ import annotations

from dataclasses import replace

import pytest

from drivetwin.identify.likelihood.priors import BOUNDS
from tests.identify.likelihood.made import bench, problem


def test_output_inertia_is_sought_about_its_design_value() -> None:
    made = bench()
    assert made.driveline.J_out is not None
    posed, start = problem(made)
    place = start.names.index("J_out")
    assert posed.lower[place] == pytest.approx(0.1 * made.driveline.J_out.value)
    assert posed.upper[place] == pytest.approx(10.0 * made.driveline.J_out.value)
    unknown = replace(made, driveline=replace(made.driveline, J_out=None))
    free, _ = problem(unknown)
    assert (free.lower[place], free.upper[place]) == BOUNDS["J_out"]
