# SPDX-License-Identifier: MIT
"""Lock-up oscillation by the paper's method."""

from __future__ import annotations

import numpy as np

from drivetwin.estimation.data.shift_data import MeasuredSignal
from drivetwin.estimation.linear.ringdown import RingDown, _refuse, _select_ring_samples
from drivetwin.estimation.linear.ringdown_settings import RING_DOWN
from drivetwin.estimation.paper.wlse import compute_window_edges, compute_window_means


def estimate_paper_ringdown(torque: MeasuredSignal, lockup: float, end: float) -> RingDown:
    """Frequency from the spacing of the extremes of T_o, damping from their logarithmic decrement.

    T_o is averaged over 10 ms windows; half the difference of neighbouring extremes falls by
    exp(-σ·T/2). Extremes count while they exceed four times the noise of an average.
    """
    part = _select_ring_samples(torque, lockup, end, RING_DOWN.latest_start)
    edges = compute_window_edges((part.time[0], part.time[-1]))
    mean, centre = compute_window_means(part, edges), 0.5 * (edges[1:] + edges[:-1])
    count = max(part.time.size / mean.size, 1.0)
    floor = 4.0 * torque.sigma / np.sqrt(count) + 1e-3 * float(np.ptp(mean))
    turn = np.flatnonzero(np.diff(np.sign(np.diff(mean))) != 0) + 1
    picked: list[int] = []
    for k in turn:
        if picked and abs(mean[k] - mean[picked[-1]]) < 2.0 * floor:
            break
        picked.append(int(k))
    if len(picked) < 4:
        raise _refuse(f"only {len(picked)} extremes stand out of the noise")
    at = np.asarray(picked)
    bend = mean[at - 1] - 2.0 * mean[at] + mean[at + 1]
    shift = 0.5 * (mean[at - 1] - mean[at + 1]) / bend
    instants = centre[at] + shift * (centre[1] - centre[0])
    order = np.arange(at.size)
    half_period = float(np.polyfit(order, instants, 1)[0])
    swing = np.log(0.5 * np.abs(np.diff(mean[at])))
    decrement = -float(np.polyfit(order[:-1], swing, 1)[0])
    rate, omega = decrement / half_period, np.pi / half_period
    if not (rate > 0.0 and RING_DOWN.band[0] < omega / (2 * np.pi) < RING_DOWN.band[1]):
        raise _refuse(f"decay rate {rate:.3g} 1/s at {omega / (2 * np.pi):.3g} Hz")
    return RingDown(
        rate, omega, np.zeros((2, 2)), part.time, part.values, part.values, instants, mean[at]
    )
