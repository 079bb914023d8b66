# SPDX-License-Identifier: MIT
"""Profiles of a shift: engine torque and clutch pressures over time."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.simulation.dual_clutch import Signal


@dataclass(frozen=True, eq=False)
class Profiles:
    """Engine torque [N m] and pressures [Pa] at the clutches, linear between their corners."""

    engine_torque: Signal
    offgoing: Signal
    oncoming: Signal

    @property
    def signals(self) -> dict[str, Signal]:
        """Signals by name, as files and figures call them."""
        return {
            "engine_torque": self.engine_torque,
            "pressure.offgoing": self.offgoing,
            "pressure.oncoming": self.oncoming,
        }

    def delay_pressures(self, delay: float) -> Profiles:
        """Return the profiles with pressures that act later by `delay` [s]."""
        late = [replace(one, delay=one.delay + delay) for one in (self.offgoing, self.oncoming)]
        return Profiles(self.engine_torque, *late)

    def sample(self, time: FloatArray) -> Profiles:
        """Return the profiles with corners at `time` (n,) [s] alone.

        The core passes samples of one distance with one operator; corners between them need their
        own in every run.
        """
        return Profiles(
            *(
                Signal(time, np.interp(time, one.arrival, one.values))
                for one in (self.engine_torque, self.offgoing, self.oncoming)
            )
        )
