# SPDX-License-Identifier: MIT
"""Spread of made units, as standard deviations beside the identified covariance."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Annotated

from pydantic import Field

from drivetwin.errors import InputError

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
