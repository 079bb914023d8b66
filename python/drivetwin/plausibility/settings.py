# SPDX-License-Identifier: MIT
"""Limits of the plausibility checks."""

from __future__ import annotations

from dataclasses import dataclass

Limits = tuple[float, float]


@dataclass(frozen=True)
class PlausibilitySettings:
    """Limits of the comparison with other entries and with a log; see `card_fields.toml` for the
    usual ranges of single entries."""

    unequal_gains: float = 5.0
    """Factor between the gains of the elements of a gearbox from which one is in doubt."""
    output_share: float = 0.2
    """Largest share of Jo' in the vehicle's inertia at the output shaft."""
    drum_share: float = 0.5
    """Largest share of a drum in J'."""
    friction: Limits = (0.05, 0.2)
    """μ of a wet clutch; outside, the gain is wrong."""
    usual_friction: Limits = (0.075, 0.18)
    """μ of nearly all wet clutches, with the error of the estimate."""
    ratio_tolerance: float = 0.01
    """Relative difference of a ratio that rounding, slip and noise explain."""
    hold: float = 0.3
    """Shortest time at one ratio that counts as a gear [s]."""
    inertia_margin: float = 1.6
    """Factor by which the torque balance may leave the design range."""
    least_pressure: float = 0.3
    """Least pressure above P0 from which μ is computed [bar]."""
    least_torque: float = 0.15
    """Least torque, over the largest of the channel, from which μ is computed."""


PLAUSIBILITY = PlausibilitySettings()
