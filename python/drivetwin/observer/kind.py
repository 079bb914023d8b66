# SPDX-License-Identifier: MIT
"""The kinds of observer, by the names used on the command line."""

from __future__ import annotations

from enum import StrEnum


class Observer(StrEnum):
    """Estimator of torques: simulation alone, or a smoother that follows the speeds."""

    SIMULATION = "simulation"
    SMOOTHER = "smoother"
