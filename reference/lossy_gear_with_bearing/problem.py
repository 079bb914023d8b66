# SPDX-License-Identifier: MIT
"""A gear pair with 50 % efficiency and a bearing; equations in the README of this folder."""

from __future__ import annotations

from dataclasses import replace

from drivetwin.simulation.network import Element
from reference.lossy_gear.problem import PROBLEM as WITHOUT_BEARING

BEARING: Element = {
    "type": "bearing",
    "name": "bearing",
    "a": "a",
    "b": "ground",
    "speed": [0.0, 1.0],
    "torque": [0.5, 1.0],
    "peak": 1.0,
}

PROBLEM = replace(
    WITHOUT_BEARING, elements=(*WITHOUT_BEARING.elements, BEARING), events_of=("bearing",)
)
