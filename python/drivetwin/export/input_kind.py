# SPDX-License-Identifier: MIT
"""Options of a fixed-step run; imported by the command line before anything numerical."""

from __future__ import annotations

from enum import StrEnum

DEFAULT_STEP = 1e-3
"""Default communication step [s]: the sampling interval of pressure signals."""


class InputKind(StrEnum):
    """Interpolation of inputs between two communication points."""

    LINEAR = "linear"
    HOLD = "hold"
