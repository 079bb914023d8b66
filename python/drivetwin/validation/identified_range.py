# SPDX-License-Identifier: MIT
"""Range of slip, pressure, torque and speed that the log of a twin covered."""

from __future__ import annotations

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.errors import Where
from drivetwin.findings import Code, Finding, Number, report
from drivetwin.simulation.dual_clutch import Trajectory

CARRIES = 0.02
"""Share of a run's largest clutch torque from which an element's slip asks for its friction."""


def name_ends(
    reached: tuple[float, float], limits: tuple[float, float], unit: str
) -> dict[str, Number]:
    """Return the ends of the range reached by a run and of its limits, for a finding."""
    names = ("low", "high", "limit_low", "limit_high")
    return {n: Number(x, unit) for n, x in zip(names, (*reached, *limits), strict=True)}


def collect_loaded_slip(run: Trajectory) -> list[FloatArray]:
    """|slip| of each element while it carries torque [rad/s]; an open one may turn at any speed."""
    torques = {name: np.abs(torque) for name, torque in run.clutch_torque.items()}
    least = CARRIES * max(float(np.nanmax(torque)) for torque in torques.values())
    return [np.abs(slip[torques[name] > least]) for name, slip in run.slip.items()]


_RANGES = {"slip": "rad/s", "pressure": "Pa", "torque": "N*m", "speed": "rad/s"}
"""Units of what a twin has a range of."""


def check_range(
    name: str, arrays: list[FloatArray], limits: tuple[float, float], place: Where | None = None
) -> list[Finding]:
    """Return a finding where arrays of quantity `name` leave the range identified."""
    if (reached := find_range_excess(arrays, limits)) is None:
        return []
    ends = name_ends(reached, limits, _RANGES[name])
    return [report(Code.OUTSIDE_IDENTIFIED_RANGE, name, place, **ends)]


def find_range_excess(
    arrays: list[FloatArray], limits: tuple[float, float]
) -> tuple[float, float] | None:
    """Least and greatest value; None where no value lies clearly beyond the limits."""
    values = np.concatenate(arrays)
    values = values[np.isfinite(values)]
    if values.size == 0:
        return None
    low, high = float(values.min()), float(values.max())
    margin = 0.02 * (limits[1] - limits[0])
    if low >= limits[0] - margin and high <= limits[1] + margin:
        return None
    return low, high
