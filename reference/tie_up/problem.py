# SPDX-License-Identifier: MIT
"""Two gears engaged at once; equations in the README of this folder."""

from __future__ import annotations

import numpy as np

from reference.dual_clutch_upshift.problem import ELEMENTS, START, TOLERANCE
from reference.parts import constant, line
from reference.problem import Phase, Problem

END = 1.6

PROBLEM = Problem(
    elements=ELEMENTS,
    phases=(
        Phase(
            END,
            {
                "torque": constant(1545.0, END),
                "B2": line((0.0, 1.0, 1.2, END), (14e5, 14e5, 0.0, 0.0)),
                "B3": line((0.0, 0.2, 0.6, END), (0.0, 0.0, 14e5, 14e5)),
            },
        ),
    ),
    start=START,
    time=np.linspace(0.0, END, 321),
    tolerance=TOLERANCE,
    events_of=("B2", "B3"),
)
