# SPDX-License-Identifier: MIT
"""Checks of logs that are to be fitted together."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from drivetwin.channels.shiftlog import ShiftLog
from drivetwin.errors import InputError, Where


def require_compatible(logs: Sequence[ShiftLog]) -> None:
    """Raise InputError for logs that cannot take part in one fit."""
    for k, one in enumerate(logs):
        for other in logs[:k]:
            if is_same_recording(one, other):
                raise InputError(
                    f"the same recording as {other.source}: counted twice, its noise would seem "
                    "smaller than it is",
                    "name each log once",
                    Where(file=one.source),
                )
    without = [log.source for log in logs if "output_torque" not in log]
    if without and len(without) < len(logs):
        raise InputError(
            f"{', '.join(without)} without an output torque among logs that have one: the former "
            "determine torques over η only, the latter torques themselves",
            "map the sensor as 'output_torque', or identify the two kinds apart",
            Where(file=without[0]),
        )


def is_same_recording(one: ShiftLog, other: ShiftLog) -> bool:
    """Return whether two logs are the same recording, even in two formats."""
    if one.sha256 == other.sha256:
        return True
    common = [role for role in one.channels if role in other]
    return bool(common) and all(
        np.array_equal(one[role].values, other[role].values) for role in common
    )
