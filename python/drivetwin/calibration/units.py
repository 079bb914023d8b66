# SPDX-License-Identifier: MIT
"""Draws of actuators: identified covariance, and production scatter."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from drivetwin._util.arrays import FloatArray
from drivetwin.actuator.model import QUANTITIES, ActuatorModel, IdentifiedActuator
from drivetwin.calibration.spread import Spread
from drivetwin.simulation.shift_control import ControlledUnit, Sensors

MakeActuators = Callable[[np.random.Generator], ControlledUnit]
"""Makes the actuators of a unit."""
DrawActuators = Callable[[np.random.Generator], MakeActuators]
"""Draws a type of actuators that the identified ones may be."""

_DEAD_TIMES = (0.25, 2.0)
"""Range of drawn dead times, over the nominal one."""


@dataclass(frozen=True, eq=False)
class UnitDraws:
    """Draws of actuators with identified values, and of the engine's lag [s] around `engine_lag`.

    Parameters that the twin's log does not determine stay at their assumed values. Each unit has
    the `sensors` with a noise of its own.
    """

    offgoing: IdentifiedActuator
    oncoming: IdentifiedActuator
    engine_lag: float
    spread: Spread
    sensors: Sensors | None = None

    @property
    def nominal(self) -> ControlledUnit:
        """Nominal unit."""
        return ControlledUnit(self.offgoing.model, self.oncoming.model, self.engine_lag)

    def __call__(self, random: np.random.Generator) -> MakeActuators:
        """Draw a type within the identified covariance."""
        identified = ControlledUnit(
            _draw_actuator(self.offgoing, random),
            _draw_actuator(self.oncoming, random),
            self.engine_lag,
        )

        def make(random: np.random.Generator) -> ControlledUnit:
            unit = scale_unit(identified, self.spread, random)
            if self.sensors is None:
                return unit
            return replace(unit, sensors=replace(self.sensors, seed=int(random.integers(2**53))))

        return make


def scale_unit(unit: ControlledUnit, spread: Spread, random: np.random.Generator) -> ControlledUnit:
    """Draw a made unit around `unit`: dead time and lags common to both clutches, fill of each."""
    late = spread.dead_time * float(random.standard_normal())
    slow = float(np.exp(spread.actuator_lag * random.standard_normal()))
    engine = float(np.exp(spread.engine_lag * random.standard_normal()))

    def scale(model: ActuatorModel) -> ActuatorModel:
        kiss = spread.kiss_pressure * float(random.standard_normal())
        fill = float(np.exp(spread.fill_time * random.standard_normal()))
        least, largest = (model.dead_time * one for one in _DEAD_TIMES)
        return _limit(
            model,
            dead_time=min(max(model.dead_time + late, least), largest),
            rising_lag=slow * model.rising_lag,
            falling_lag=slow * model.falling_lag,
            kiss_pressure=model.kiss_pressure + (kiss if model.fill_time > 0.0 else 0.0),
            fill_time=fill * model.fill_time,
        )

    return ControlledUnit(scale(unit.offgoing), scale(unit.oncoming), engine * unit.engine_lag)


def _draw_actuator(one: IdentifiedActuator, random: np.random.Generator) -> ActuatorModel:
    finite = np.isfinite(one.std)
    covariance = np.where(np.outer(finite, finite), one.covariance, 0.0)
    drawn = random.multivariate_normal(one.model.values, covariance, method="eigh")
    return ActuatorModel.from_values(_clip(drawn))


def _limit(model: ActuatorModel, **changed: float) -> ActuatorModel:
    values = {name: changed.get(name, getattr(model, name)) for name in QUANTITIES}
    return ActuatorModel.from_values(_clip(np.array(list(values.values()))))


def _clip(values: FloatArray) -> FloatArray:
    low = [one.lower for one in QUANTITIES.values()]
    high = [one.upper for one in QUANTITIES.values()]
    return np.clip(values, low, high)
