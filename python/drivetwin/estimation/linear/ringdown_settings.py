# SPDX-License-Identifier: MIT
"""Settings of the estimates from the oscillation after lock-up."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RingDownSettings:
    """Settings of the ring-down of the output shaft after lock-up."""

    latest_start: float = 0.05
    """Latest start of the fit after lock-up [s]; at 30 Hz most of the power is lost by then."""
    min_length: float = 0.15
    """Shortest fitted span [s]."""
    max_length: float = 1.6
    """Longest fitted span [s]: by then a driveline oscillation has decayed."""
    min_samples: int = 20
    """Fewest fitted samples [count]."""
    band: tuple[float, float] = (2.0, 60.0)
    """Range of the first torsional mode of a driveline [Hz]."""
    max_nyquist_share: float = 0.8
    """Highest estimated frequency over the Nyquist frequency [ratio]."""
    chance: float = 1e-6
    """Probability with which noise alone may pass for an oscillation [probability]. One that just
    passes has a size and decay distorted by noise, hence the small value."""
    knots_per_period: int = 8
    """Knots of an unknown torque in a period of the oscillation [count]."""
    max_knots: int = 200
    """Most knots [count]: as many fill the longest span at 16 Hz; faster ones decay before."""
    min_response: float = 1e-6
    """Smallest response that counts, over the strongest [ratio]."""


RING_DOWN = RingDownSettings()
