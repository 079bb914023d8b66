# SPDX-License-Identifier: MIT
"""Differences between made units beside the covariance, and friction over oil temperature.

Spread: standard deviations of units of one type. Oil: μ(T) = μ(T_log)·(1 + s·(T - T_log)): the twin
has μ at the oil temperature of its log. The slope s is known roughly; a log at one temperature does
not determine it. Logs of one unit at several temperatures do.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from drivetwin._util.arrays import NEGLIGIBLE, FloatArray
from drivetwin.errors import InputError
from drivetwin.estimation.identification import OIL_TEMPERATURE
from drivetwin.parameters import LAW_KEYS
from drivetwin.simulation.dual_clutch import DualClutch
from drivetwin.twin.distribution import ModelDistribution, scale_friction
from drivetwin.twin.twin import Twin

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

    def place(self, twin: Twin) -> OilFriction:
        """Return it with the oil temperature of a twin's log, unless one is stated."""
        if self.log_temperature is not None or OIL_TEMPERATURE not in twin.validity:
            return self
        return replace(self, log_temperature=0.5 * sum(twin.validity[OIL_TEMPERATURE]))

    def compute_factor(self, temperature: float | None) -> float:
        """Compute μ at a temperature [K] over that at the log's; 1 where either is not known."""
        if temperature is None or self.log_temperature is None:
            return 1.0
        return _compute_factor(self.slope, temperature - self.log_temperature)

    def heat(self, temperature: float | None) -> OilFriction:
        """Return it over the friction at a temperature [K]; None is that of the log."""
        factor = self.compute_factor(temperature)
        at = self.log_temperature if temperature is None else temperature
        return OilFriction(self.slope / factor, self.std / factor, at)


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
        factor = _compute_factor(slope, self.change + more)
        first, second = (scale_friction(one, factor) for one in model.elements)
        return replace(model, elements=(first, second))


SAME_OIL = OilState()
"""Oil as in the twin's log, with the usual friction over the temperature."""


def _compute_factor(slope: float, change: float) -> float:
    return max(1.0 + slope * change, _LEAST)


@dataclass(frozen=True, eq=False)
class WarmUnit:
    """Distribution of a made unit at an oil temperature, with the friction over the temperature.

    `common` (p,) is the covariance of the slope with the values of the unit.
    """

    unit: ModelDistribution
    oil: OilFriction
    common: FloatArray

    def heat(self, temperature: float | None) -> WarmUnit:
        """Return the distribution at a temperature [K]; None is that of the unit.

        x' = x·(1 + s·ΔT) for the coefficients of a friction law, linear about the mean of s.
        """
        oil, unit = self.oil.heat(temperature), self.unit
        factor = self.oil.compute_factor(temperature)
        acting = _find_scaled(unit.ids)
        change = 0.0
        if oil.log_temperature is not None and self.oil.log_temperature is not None:
            change = oil.log_temperature - self.oil.log_temperature
        scale, own = np.where(acting, factor, 1.0), change * acting * unit.values
        common, variance = scale * self.common, self.oil.std**2
        both = np.outer(own, common)
        covariance = np.outer(scale, scale) * unit.covariance + both + both.T
        moved = replace(
            unit,
            values=scale * unit.values,
            covariance=covariance + variance * np.outer(own, own),
        )
        return WarmUnit(moved, oil, (common + variance * own) / factor)

    def learn(self, found: ModelDistribution) -> WarmUnit:
        """Return the distribution `found` with this one as prior, and the slope by it.

        The slope follows the values by its regression on them: only these were measured.
        """
        own, other = (
            np.array([one.ids.index(name) for name in self.unit.ids if name in found.ids])
            for one in (self.unit, found)
        )
        prior = self.unit.covariance[np.ix_(own, own)]
        scale = np.sqrt(np.diag(prior))
        inverse = np.linalg.pinv(prior / np.outer(scale, scale), NEGLIGIBLE, hermitian=True)
        gain = inverse @ (self.common[own] / scale) / scale
        posterior = found.covariance[np.ix_(other, other)]
        less = float(gain @ (prior - posterior) @ gain)
        slope = self.oil.slope + float(gain @ (found.values[other] - self.unit.values[own]))
        std = float(np.sqrt(np.clip(self.oil.std**2 - less, 0.0, self.oil.std**2)))
        common = found.covariance[:, other] @ gain
        return WarmUnit(found, replace(self.oil, slope=slope, std=std), common)


def warm_twin(twin: Twin, factor: float) -> Twin:
    """Return the twin with its friction times a factor."""
    covariance = twin.covariance
    if covariance is not None:
        scale = np.where(_find_scaled(twin.covariance_ids), factor, 1.0)
        covariance = np.outer(scale, scale) * covariance
    curves = {name: one.scale(factor) for name, one in twin.friction.items()}
    return replace(twin, friction=curves, covariance=covariance)


def _find_scaled(ids: tuple[str, ...]) -> NDArray[np.bool_]:
    """Find the coefficients of friction laws that a factor on μ multiplies."""
    return np.array([one.partition(".")[0] in LAW_KEYS[:3] for one in ids], dtype=bool)
