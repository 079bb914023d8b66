# SPDX-License-Identifier: MIT
"""Elements of a shift whose friction law is identifiable, because they slip under load long enough.

The on-coming element always does. An off-going element does if it holds the engine back while the
speed passes to the other gear: in a power-on downshift and a power-off upshift.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from drivetwin.estimation.data.shift_data import KnownDriveline, ShiftSignals
from drivetwin.estimation.likelihood.data.input_smoothing import smooth_adaptive


@dataclass(frozen=True)
class SlippingElementSettings:
    """Settings of the search for elements with an identifiable friction law."""

    min_filled: float = 0.15
    """Time for which an off-going element must be filled in the inertia phase [s]."""
    filled_sigma: float = 3.0
    """Pressure above P0 from which an element is filled, in its noise: closer to P0, noise feigns
    information on μ [-]."""


SLIPPING = SlippingElementSettings()


def find_slipping_elements(signals: ShiftSignals, driveline: KnownDriveline) -> tuple[str, ...]:
    """Find the elements of one shift whose law is free, the on-coming one first."""
    coming, leaving = driveline.oncoming, driveline.offgoing
    pressure = signals.pressures[leaving.name]
    start, end = signals.shift.inertia_phase
    steady = smooth_adaptive(pressure)  # noise lifts single samples above P0
    inside = (pressure.time > start) & (pressure.time < end)
    limit = leaving.P0.value + 2.0 * leaving.P0.std + SLIPPING.filled_sigma * pressure.sigma
    filled = np.count_nonzero(inside & (steady > limit))
    slides = filled * float(np.median(np.diff(pressure.time))) > SLIPPING.min_filled
    return (coming.name, leaving.name) if slides else (coming.name,)


def find_all_slipping_elements(
    signals: Sequence[ShiftSignals], drivelines: Sequence[KnownDriveline]
) -> tuple[str, ...]:
    """Find the elements whose law is free over all shifts, without repetition."""
    pairs = zip(signals, drivelines, strict=True)
    return tuple(dict.fromkeys(name for s, d in pairs for name in find_slipping_elements(s, d)))
