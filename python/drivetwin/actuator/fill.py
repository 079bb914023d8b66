# SPDX-License-Identifier: MIT
"""Hysteresis of the valve, and the stroke of the clutch piston against its return spring."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, inf, sqrt

import numpy as np
from scipy.constants import bar

from drivetwin.actuator.held_signal import HeldSignal

REFERENCE: float = bar
"""Pressure [Pa] above the kiss pressure at which the fill time is stated."""


def apply_hysteresis(command: HeldSignal, width: float, initial: float) -> HeldSignal:
    """Return the pressure of the valve: a play of `width` [Pa] centred on the command.

    On a rising command it is half the width below it, on a falling one half above it, never below
    zero; a command of zero or less shuts the valve. `initial` [Pa] is its pressure at the start.
    """
    half, valve = 0.5 * width, initial
    values = []
    for wanted in command.values.tolist():
        moved = min(max(valve, wanted - half, 0.0), wanted + half)
        valve = moved if wanted > 0.0 else 0.0
        values.append(valve)
    return HeldSignal(command.time, np.array(values))


@dataclass(frozen=True)
class Stroke:
    """The piston: its spring holds `kiss_pressure` [Pa] while the clutch is not full.

    The stroke takes `fill_time` [s] at 1 bar above the kiss pressure, and changes with the root of
    the pressure difference (flow through an orifice) in both directions.
    """

    kiss_pressure: float
    fill_time: float

    def compute_rate(self, valve: float) -> float:
        """Rate [1/s] at which the share of the volume that is filled changes."""
        over = (valve - self.kiss_pressure) / REFERENCE
        return copysign(sqrt(abs(over)), over) / self.fill_time

    def limit_pressure(self, valve: HeldSignal) -> HeldSignal:
        """Return what of the pressure of the valve acts: at most the kiss pressure until full.

        A clutch whose valve is above the kiss pressure at the start is full. The instants at which
        it becomes full are exact.
        """
        if self.fill_time <= 0.0:
            return valve
        filled = 1.0 if valve.values[0] > self.kiss_pressure else 0.0
        times, values = [], []
        ends = [*valve.time[1:].tolist(), inf]
        for begin, end, value in zip(valve.time.tolist(), ends, valve.values.tolist(), strict=True):
            rate = self.compute_rate(value)
            full = begin + (1.0 - filled) / rate if rate > 0.0 else inf
            if full <= begin:  # the rest of the volume is below the resolution of time
                filled = 1.0
            times.append(begin)
            values.append(min(value, self.kiss_pressure) if filled < 1.0 else value)
            if rate > 0.0 and begin < full < end:
                times.append(full)
                values.append(value)
            if end < inf:
                filled = 1.0 if full <= end else min(1.0, max(0.0, filled + rate * (end - begin)))
        return HeldSignal(np.array(times), np.array(values))
