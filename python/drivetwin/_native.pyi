# SPDX-License-Identifier: MIT
"""The compiled core. Private: use `drivetwin.driveline` and `drivetwin.network`."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["simulate", "simulate_network"]

_Array = NDArray[np.float64]
_Options = tuple[float, float, int | None, bool]
_Run = tuple[
    _Array,
    list[tuple[float, str, str]],
    str,
    tuple[float, float, float, float, float, float, float, float, float] | None,
]

def simulate(
    model: str,
    signals: Sequence[tuple[str, _Array, _Array]],
    start: tuple[float, float, float, float, Sequence[str]],
    grid: _Array,
    options: _Options,
) -> _Run: ...
def simulate_network(
    driveline: str,
    outputs: str,
    signals: tuple[
        Sequence[tuple[str, _Array, _Array]], Sequence[tuple[str, float, float, float, float]]
    ],
    start: tuple[Sequence[tuple[str, float]], Sequence[tuple[str, float]], Sequence[str]],
    grid: _Array,
    options: _Options,
) -> _Run: ...
