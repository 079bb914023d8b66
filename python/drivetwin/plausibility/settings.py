# SPDX-License-Identifier: MIT
"""Limits of the plausibility checks."""

from __future__ import annotations

from dataclasses import dataclass

Limits = tuple[float, float]


@dataclass(frozen=True)
class PlausibilitySettings:
    """Usual ranges of card entries, in the unit of the entry, and limits of the comparison."""

    ratio: Limits = (0.3, 12.0)
    """Ratio of a gear or of the input gear."""
    final_drive: Limits = (0.9, 20.0)
    """Ratio of the final drive with hub reduction; 1 refers the vehicle to the output shaft."""
    efficiency: Limits = (0.7, 1.0)
    """Efficiency of a gearbox."""
    gain: Limits = (2e-4, 0.2)
    """N·D·A·r of a car's to a heavy truck's clutch [m^3]."""
    unequal_gains: float = 5.0
    """Factor between the gains of the elements of a gearbox from which one is in doubt."""
    surfaces: Limits = (2, 40)
    """Friction surfaces of a pack."""
    derating: Limits = (0.4, 1.0)
    """De-rating of a pack."""
    area: Limits = (5e-4, 0.15)
    """Area of a friction surface [m^2]."""
    radius: Limits = (0.02, 0.5)
    """Effective radius [m]."""
    fill_pressure: Limits = (0.0, 6.0)
    """P0 [bar]."""
    engine_inertia: Limits = (0.02, 100.0)
    """J' at the engine [kg m^2]."""
    vehicle_inertia: Limits = (15.0, 40_000.0)
    """J3 at the wheel [kg m^2]; with a final drive of 1 at the output shaft, hence `i_f`² less."""
    wheel_radius: Limits = (0.25, 0.6)
    """Wheel radius [m] that relates J3 to a mass."""
    output_share: float = 0.2
    """Largest share of Jo' in the vehicle's inertia at the output shaft."""
    drum_share: float = 0.5
    """Largest share of a drum in J'."""
    gain_tolerance: float = 0.1
    """Largest usual relative tolerance of a sensor."""
    torque_tolerance: float = 1000.0
    """Largest usual offset tolerance of a torque [N m]."""
    speed_tolerance: float = 50.0
    """Largest usual offset tolerance of a speed [rpm]."""
    pressure_tolerance: float = 1.0
    """Largest usual offset tolerance of a pressure [bar]."""
    age_tolerance: float = 500.0
    """Largest usual tolerance of the age of a sample [ms]."""
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
