# SPDX-License-Identifier: MIT
"""Differences between made units beside the covariance, and friction over oil temperature.

Spread: standard deviations of units of one type. Oil: μ(T) = μ(T_log)·(1 + s·(T - T_log)): the twin
has μ at the oil temperature of its log. The slope s is known roughly; a log at one temperature does
not determine it.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Annotated

import numpy as np
from pydantic import Field

from drivetwin.errors import InputError
from drivetwin.simulation.dual_clutch import DualClutch
from drivetwin.twin.distribution import scale_friction

Share = Annotated[float, Field(ge=0, lt=0.5)]


@dataclass(frozen=True)
class Spread:
    """Standard deviations of what differs between units of one type.

    The defaults are engineering estimates of series production, not measurements; a fleet
    gives better ones.
    """

    gain: Share = 0.025
    """Friction gain of each clutch, relative, independent."""
    engine_torque: Share = 0.015
    """Scale of the engine torque, relative."""
    contact_pressure: Annotated[float, Field(ge=0, alias="contact_pressure_Pa")] = 5e3
    """Contact pressure P0 [Pa], common to both clutches."""
    dead_time: Annotated[Share, Field(alias="dead_time_s")] = 5e-3
    """Dead time of the actuators [s], common to both clutches."""
    actuator_lag: Share = 0.10
    """Lags of the actuators, relative, common to both clutches."""
    kiss_pressure: Annotated[float, Field(ge=0, alias="kiss_pressure_Pa")] = 5e3
    """Kiss pressure of each actuator [Pa], independent."""
    fill_time: Share = 0.05
    """Fill time of each actuator, relative, independent."""
    engine_lag: Share = 0.15
    """Time constant of the engine torque, relative."""
    oil_temperature: Annotated[float, Field(ge=0, lt=100, alias="oil_temperature_K")] = 5.0
    """Oil temperature of a shift [K], common to both clutches."""

    def __post_init__(self) -> None:
        for one in fields(self):
            value = getattr(self, one.name)
            if not 0.0 <= value < float("inf"):
                raise InputError(
                    f"spread of {one.name} is {value!r}",
                    "give a standard deviation that is finite and not negative",
                )


FRICTION_SLOPE = -0.065 / 100.0
"""Usual slope of μ over the oil temperature, over μ [1/K]; typical range of paper linings: μ falls
by 3 to 10 % per 100 K, see Mäki, Wet Clutch Tribology, 2005, on friction over temperature."""
FRICTION_SLOPE_STD = 0.3
"""Standard deviation of the slope without a stated one, over it [ratio]; the same range counts as
that of 90 % of the linings."""
_LEAST = 0.05
"""Least factor on μ of a draw [ratio]; below it the linear law means nothing."""


@dataclass(frozen=True)
class OilFriction:
    """Slope of μ over temperature, over μ, and its standard deviation [1/K].

    `log_temperature` [K] is the oil temperature of the twin's log; None: as the twin states it.
    """

    slope: float = FRICTION_SLOPE
    std: float = FRICTION_SLOPE_STD * abs(FRICTION_SLOPE)
    log_temperature: float | None = None


@dataclass(frozen=True)
class OilState:
    """Oil of a shift: its temperature over that of the twin's log [K], and the friction over it."""

    change: float = 0.0
    friction: OilFriction = OilFriction()

    def draw_slope(self, random: np.random.Generator) -> float:
        """Draw the slope [1/K] of a vehicle type."""
        return float(random.normal(self.friction.slope, self.friction.std))

    def warm(self, model: DualClutch, slope: float | None = None, more: float = 0.0) -> DualClutch:
        """Return the model with the friction of this oil.

        Parameters
        ----------
        model
            Model with the friction of the twin's log.
        slope
            Slope of the friction [1/K], by default the usual one.
        more
            Temperature above that of this oil [K].
        """
        slope = self.friction.slope if slope is None else slope
        factor = max(1.0 + slope * (self.change + more), _LEAST)
        first, second = (scale_friction(one, factor) for one in model.elements)
        return replace(model, elements=(first, second))


SAME_OIL = OilState()
"""Oil as in the twin's log, with the usual friction over the temperature."""
