# SPDX-License-Identifier: MIT
"""The compiled core. Private: use `drivetwin.driveline`."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["simulate"]

_Array = NDArray[np.float64]

def simulate(
    model: str,
    signals: Sequence[tuple[str, _Array, _Array]],
    start: tuple[float, float, float, float, Sequence[str]],
    grid: _Array,
    options: tuple[float, float, int | None, bool],
) -> tuple[
    _Array,
    list[tuple[float, str, str]],
    str,
    tuple[float, float, float, float, float, float, float, float, float] | None,
]: ...
