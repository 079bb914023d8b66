# SPDX-License-Identifier: MIT
"""How a fixed-step importer hands inputs to a model."""

from __future__ import annotations

from enum import StrEnum

DEFAULT_STEP = 1e-3
"""Communication step [s] where nobody asks for another: the rate of pressure signals."""


class InputKind(StrEnum):
    """What inputs do between two communication points."""

    LINEAR = "linear"
    HOLD = "hold"
