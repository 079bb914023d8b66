# SPDX-License-Identifier: MIT
"""Second-order lag with different time constants for rising and falling pressure.

With e = p - w, the distance of the pressure p from a held input w:

    T²·e'' + 2·ζ·T·e' + e = 0,    T = T_r where e < 0 (rising), T = T_f where e > 0 (falling)

Between changes of the input and crossings e = 0 the solution is known in closed form, and so is
the time of the next crossing. Pressure and rate are continuous throughout; no step is integrated.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, atanh, cos, cosh, exp, inf, pi, sin, sinh, sqrt

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.actuator.held_signal import HeldSignal

_REST = 1e-6
"""Distance [Pa] from the input below which the pressure is at rest on it."""
_CRITICAL = 1e-6
"""Value of |ζ² - 1| below which the damping counts as critical."""


@dataclass(frozen=True)
class Lag:
    """Time constants T [s] of rising and falling pressure, and the common damping ratio ζ."""

    rising: float
    falling: float
    damping: float

    def get_frequency(self, offset: float, rate: float) -> float:
        """Return 1/T [rad/s] at a distance [Pa] from the input, moving at a rate [Pa/s]."""
        falls = offset > 0.0 or (offset == 0.0 and rate > 0.0)
        return 1.0 / (self.falling if falls else self.rising)


@dataclass(frozen=True, eq=False)
class LagResponse:
    """Response in pieces (n,): from `start` [s] to the next, `input` [Pa] and one time constant.

    `offset` [Pa] is the distance from the input at the start of a piece, `rate` [Pa/s] that of the
    pressure, `frequency` [rad/s] the reciprocal of the time constant.
    """

    start: FloatArray
    input: FloatArray
    offset: FloatArray
    rate: FloatArray
    frequency: FloatArray
    damping: float

    def evaluate(self, at: FloatArray) -> FloatArray:
        """Pressure [Pa] at the times `at` (m,) [s]; before the first piece that of its start."""
        piece = np.clip(np.searchsorted(self.start, at, side="right") - 1, 0, None)
        passed = np.maximum(at - self.start[piece], 0.0)
        offset, frequency = self.offset[piece], self.frequency[piece]
        even, odd = _compute_basis(passed, frequency, self.damping)
        slope = self.rate[piece] + self.damping * frequency * offset
        return np.asarray(self.input[piece] + offset * even + slope * odd)


def solve_lag(held: HeldSignal, initial: float, lag: Lag) -> LagResponse:
    """Solve the lag for a held input from rest at the pressure `initial` [Pa]."""
    pieces: list[tuple[float, float, float, float, float]] = []
    offset, rate = initial - float(held.values[0]), 0.0
    ends = [*held.time[1:].tolist(), inf]
    before = float(held.values[0])
    for begin, end, value in zip(held.time.tolist(), ends, held.values.tolist(), strict=True):
        offset, before = offset + before - value, value
        now = begin
        while now < end:
            frequency = lag.get_frequency(offset, rate)
            if abs(offset) + abs(rate) / frequency < _REST:
                offset = rate = 0.0
            pieces.append((now, value, offset, rate, frequency))
            crossing = now + _find_crossing(offset, rate, frequency, lag.damping)
            upto = min(crossing, end)
            if upto == inf:
                break
            offset, rate = _advance((offset, rate), upto - now, frequency, lag.damping)
            if crossing <= end:
                offset = 0.0
            now = upto
    start, value, offsets, rates, frequencies = np.array(pieces, dtype=np.float64).T
    return LagResponse(start, value, offsets, rates, frequencies, lag.damping)


def _find_crossing(offset: float, rate: float, frequency: float, damping: float) -> float:
    """Time [s] to the next zero of the distance from the input; infinite where there is none."""
    if offset == 0.0 and (damping >= 1.0 or rate == 0.0):
        return inf
    slope = rate + damping * frequency * offset
    excess = damping * damping - 1.0
    if abs(excess) <= _CRITICAL:
        return -offset / slope if offset * slope < 0.0 else inf
    root = frequency * sqrt(abs(excess))
    if excess < 0.0:
        angle = pi if offset == 0.0 else atan2(-offset, slope / root) % pi
        return (angle if angle > 0.0 else pi) / root
    share = -offset * root / slope if slope else inf
    return atanh(share) / root if 0.0 < share < 1.0 else inf


def _advance(
    state: tuple[float, float], time: float, frequency: float, damping: float
) -> tuple[float, float]:
    """Distance from the input [Pa] and rate [Pa/s] after a time [s] without crossing."""
    offset, rate = state
    decay, excess = damping * frequency, damping * damping - 1.0
    root = frequency * sqrt(abs(excess))
    if abs(excess) <= _CRITICAL:
        even = exp(-decay * time)
        odd = time * even
    elif excess < 0.0:
        even = exp(-decay * time)
        even, odd = even * cos(root * time), even * sin(root * time) / root
    elif root * time < 1.0:
        even = exp(-decay * time)
        even, odd = even * cosh(root * time), even * sinh(root * time) / root
    else:
        slow, fast = exp((root - decay) * time), exp(-(root + decay) * time)
        even, odd = 0.5 * (slow + fast), 0.5 * (slow - fast) / root
    moved = offset * even + (rate + decay * offset) * odd
    return moved, rate * even - (frequency * frequency * offset + decay * rate) * odd


def _compute_basis(
    time: FloatArray, frequency: FloatArray, damping: float
) -> tuple[FloatArray, FloatArray]:
    """Solutions (m,) that start with value 1 and slope -ζ/T, and with value 0 and slope 1."""
    decay, excess = damping * frequency, damping * damping - 1.0
    root = frequency * np.sqrt(abs(excess))
    if abs(excess) <= _CRITICAL:
        even = np.exp(-decay * time)
        return even, time * even
    if excess < 0.0:
        even = np.exp(-decay * time)
        return even * np.cos(root * time), even * np.sin(root * time) / root
    slow, ratio = np.exp((root - decay) * time), np.expm1(-2.0 * root * time)
    return slow * (1.0 + 0.5 * ratio), -0.5 * slow * ratio / root
