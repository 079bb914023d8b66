# SPDX-License-Identifier: MIT
"""Which elements of a shift slip under load so long that the log shows their friction over slip.

The one that comes on always does. One that lets go does where it holds the engine back while the
speed passes to the other gear: in a power-on downshift and a power-off upshift.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin.identify.signals import Driveline, ShiftSignals

SLIDES = 0.15
"""Time [s] for which an off-going element must stay filled in the inertia phase."""


def carriers(signals: ShiftSignals, driveline: Driveline) -> tuple[str, ...]:
    """Names of the elements of one shift whose law is free, the on-coming one first."""
    coming, leaving = driveline.oncoming, driveline.offgoing
    pressure = signals.pressures[leaving.name]
    start, end = signals.shift.inertia_phase
    inside = (pressure.time > start) & (pressure.time < end)
    limit = leaving.P0.value + 2.0 * leaving.P0.std + 3.0 * pressure.sigma
    filled = pressure.time[inside & (pressure.values > limit)]
    slides = filled.size > 0 and float(np.ptp(filled)) > SLIDES
    return (coming.name, leaving.name) if slides else (coming.name,)


def all_carriers(
    signals: Sequence[ShiftSignals], drivelines: Sequence[Driveline]
) -> tuple[str, ...]:
    """The same over all shifts, each once."""
    pairs = zip(signals, drivelines, strict=True)
    return tuple(dict.fromkeys(name for s, d in pairs for name in carriers(s, d)))
